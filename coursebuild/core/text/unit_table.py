"""The units that there are: symbols, names and sizes.

The table grows by cases: with all units that there are, `link`, `hand` and `pole` would be some.
Sizes are exact, as defined by the SI Brochure (2019), NIST SP 811 (2008) and the IAU (2012, 2015);
those of `u`, `bohr`, `hartree` and `Ry` are measured, and given as CODATA published them in 2022,
2018 and 2014. A unit with several sizes is read as any of these: a calorie is thermochemical or of
the steam tables, a revolution a cycle or an angle, `Sv` a sievert or, in an ocean, a sverdrup.
"""

from __future__ import annotations

from msgspec import Struct

_TABLE = """
m* 1 m meter metre meters metres Meter Metern metro metros
g* 1e-3,9.80665:m/s^2 kg gram grams gramme grammes Gramm gramo gramos
s* 1 s second seconds Sekunde Sekunden seconde secondes segundo segundos
sec* 1 s secs
A*! 1 A ampere amperes Ampere amp amps amperio amperios
K* 1 K kelvin kelvins Kelvin
mol* 1 mol mole moles Mol
cd* 1 cd candela candelas
rad* 1 rad radian radians Radiant
sr* 1 rad^2 steradian steradians
Hz* 1 cycle/s hertz Hertz
N* 1 kg*m/s^2 newton newtons Newton
Pa* 1 N/m^2 pascal pascals Pascal
J* 1 N*m joule joules Joule julios
W* 1 J/s watt watts Watt vatio vatios
C*! 1,1@273.15:K A*s coulomb coulombs Coulomb
V* 1 W/A volt volts Volt voltio voltios
F*! 1,5/9@459.67:K C/V farad farads Farad
Ω* 1 V/A ohms Ohm ohmio ohmios
ohm* 1 V/A
S*! 1,1e-13:s A/V siemens mho mhos
Wb* 1 V*s weber webers
T*! 1 Wb/m^2 tesla teslas Tesla
H*! 1 Wb/A henry henries Henry
lm* 1 cd*sr lumen lumens
lx* 1 lm/m^2 lux
nit? 1 cd/m^2 nits
Bq* 1 1/s becquerel becquerels
Gy* 1 J/kg gray grays
Sv* 1,1e6:m^3/s J/kg sievert sieverts
rem*? 1e-2 Sv rems
kat* 1 mol/s katal
Nm* 1 N*m Newtonmeter Newtonmetern
Nms* 1 N*m*s
Nmm 1e-3 N*m
VA* 1 W
VAr* 1 W
Ws* 1 J
Wh* 3600 J Wattstunde Wattstunden
Ah* 3600 C Amperestunde Amperestunden
min 60 s minute minutes Minute Minuten mins minuto minutos
h! 3600 s hour hours hr hrs Stunde Stunden heure heures hora horas
d! 86400 s day days Tag Tage Tagen Tages jour jours dia dias
week? 604800 s weeks Woche Wochen semaine semaines semana semanas
fortnight? 1209600 s fortnights
month? 2629800,2628000,2592000,2629746 s months Monat Monate Monaten mois meses
a*? 31557600,31536000,31556952,100:m^2 s
yr* 31557600,31536000,31556952 s year years Jahr Jahre Jahren annee annees año años
century? 3155760000,3153600000,3155695200 s centuries
t*! 1e3 kg tonne tonnes Tonne Tonnen tonelada toneladas
kt 1e6,1852/3600:m/s kg
ton 1e3,907.18474,1016.0469088,3516.8528420667:W kg tons
L*! 1e-3 m^3 litre litres liter liters Liter Litern litro litros
l*! 1e-3 m^3
cc 1e-6 m^3 ccm
ha 1e4 m^2 hectare hectares Hektar
au 149597870700 m AU
ly* 9460730472580800 m lightyear lightyears Lichtjahr Lichtjahre
pc* 96939420213600000/π m parsec parsecs
Å 1e-10 m angstrom ångström angstroms
micron 1e-6 m microns
bohr 5.29177210544e-11,5.29177210903e-11,5.2917721067e-11 m
in? 0.0254 m inch inches
ft 0.3048 m foot feet
yd 0.9144 m yard yards
mi 1609.344 m mile miles
furlong 201.168 m furlongs
fathom 1.8288 m fathoms
nmi 1852 m
mph 1609.344 m/h
kn 1852 m/h knot knots kts
kph 1e3 m/h kmh Stundenkilometer
mps 1 m/s
acre? 4046.8564224 m^2 acres
gal? 3.785411784e-3,4.54609e-3 m^3 gallon gallons
quart 0.946352946e-3,1.1365225e-3 m^3 quarts
pint 0.473176473e-3,0.56826125e-3 m^3 pints
gpm 3.785411784e-3,4.54609e-3 m^3/min
cfm 0.028316846592 m^3/min
barn*? 1e-28 m^2 barns
u? 1.66053906892e-27,1.66053906660e-27,1.660539040e-27 kg amu
Da* 1.66053906892e-27,1.66053906660e-27,1.660539040e-27,9.869233e-13:m^2 kg dalton daltons
lb 0.45359237,4.4482216152605:N kg lbs pound pounds
slug? 4.4482216152605/0.3048 kg slugs
oz 0.028349523125,0.0311034768,29.5735295625e-6:m^3,28.4130625e-6:m^3 kg ounce ounces
ct? 2e-4 kg carat carats
dyn 1e-5 N
kgf 9.80665 N kp
lbf 4.4482216152605 N
kip? 4448.2216152605 N kips
bar* 1e5 Pa bars
atm 101325 Pa atmosphere atmospheres Atmosphäre Atmosphären atmosfera atmosferas
mmHg 133.322387415,101325/760 Pa
inHg 3386.388640341,3386.389 Pa
Torr* 101325/760 Pa torr
psi 4.4482216152605/0.00064516 Pa
eV* 1.602176634e-19 J electronvolt electronvolts
hartree 4.3597447222060e-18,4.3597447222071e-18,4.359744650e-18 J hartrees Hartree
Ry? 2.1798723611030e-18,2.1798723611035e-18,2.179872325e-18 J rydberg rydbergs Rydberg
cal* 4.184,4.1868,4.1855 J calorie calories Kalorie Kalorien
Cal 4184,4186.8,4185.5 J
BTU 1055.05585262,1054.35 J Btu
erg 1e-7 J
hp 745.69987158227022,735.49875 W horsepower
PS 735.49875 W
°C 1@273.15 K degC celsius Celsius
°F 5/9@459.67 K degF fahrenheit Fahrenheit
degR 5/9 K rankine Rankine
° π/180 rad deg degree degrees Grad degre degres grado grados
′ π/10800 rad arcmin arcminute arcminutes
″ π/648000 rad arcsec arcsecond arcseconds
mas? π/648000000 rad
gon π/200 rad gradian gradians
rev 1,2π cycle revolution revolutions Umdrehung Umdrehungen
U!? 1,1/6e7:mol/s,2π cycle
tr!? 1,2π cycle
turn? 1,2π cycle turns
rpm 1/60,π/30 cycle/s RPM
rps 1,2π cycle/s RPS
G*! 1e-4,9.80665:m/s^2 T gauss Gauss
Oe* 250/π A/m oersted oersteds
Mx* 1e-8 Wb maxwell maxwells
Gal* 1e-2 m/s^2
P*! 0.1 Pa*s poise
St* 1e-4 m^2/s stokes
M*! 1e3 mol/m^3
Ci* 3.7e10 Bq curie
% 1e-2 1 percent Prozent pct
‰ 1e-3 1 Promille
ppm 1e-6 1
ppb 1e-9 1
bit* 1 bit bits
B*! 8 bit byte bytes
KB 8000,8192 bit
kB 8000,8192 bit
MB 8e6,8388608 bit
GB 8e9,8589934592 bit
TB 8e12,8796093022208 bit
Bd* 1 1/s
bps* 1,1e-4:1 bit/s
FLOPS* 1 1/s
fps 1,0.3048:m/s 1/s
px 1 px pixel pixels
pt! 0.0254/72,0.473176473e-3:m^3,0.56826125e-3:m^3 m
dB ? 1 decibel dBA dB(A) dBC dB(C)
Np ? 1
"""
"""Symbol, with marks; sizes in the third column's unit; names.

Names are English, German, French and Spanish, without accents. A star: it takes prefixes. `!`: it
is a name as often, as in `T = 2`; `?`: a word as often. After an `@` stands where a scale begins:
0 °C are 273.15 of its degrees above absolute zero. A colon comes before the unit of a size that
measures something else than the first. The levels of a logarithmic scale have no size.
"""


class UnitRow(Struct, frozen=True):
    """A row of the table."""

    sizes: tuple[str, ...]
    base: str
    marks: str


def _read_table() -> tuple[dict[str, UnitRow], dict[str, str]]:
    rows: dict[str, UnitRow] = {}
    names: dict[str, str] = {}
    for line in _TABLE.strip().splitlines():
        symbol, sizes, base, *other_names = line.split()
        bare = symbol.rstrip("*!?")
        rows[bare] = UnitRow(tuple(sizes.split(",")), base, symbol.removeprefix(bare))
        names.update(dict.fromkeys(other_names, bare))
    return rows, names


UNITS, NAMES = _read_table()
LEVELS = frozenset(symbol for symbol, row in UNITS.items() if "?" in row.sizes)
"""Of a logarithmic scale, without a size."""
