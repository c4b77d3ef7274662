"""What of MuJoCo lab code can use and have translated: names of the bindings and their types.

Entry points: `ARRAYS`, `SCALARS`, `CALLS`.

In JavaScript every array is flat, in Python one of several numbers a row has two dimensions. Here
are the floats, whole numbers and booleans that labs have a use for: states, forces, poses, and what
a model's bodies, joints, actuators and the like are made of; not how meshes, sparse matrices and
trees are stored. A test holds these tables against both bindings.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, TypeAlias

from msgspec import Struct

Element: TypeAlias = Literal["f64", "f32", "int"]


class ArrayField(Struct, frozen=True):
    """An array of the model or the data: what it holds, and whether NumPy sees rows."""

    element: Element
    rows: bool


_ARRAYS: dict[tuple[str, Element, bool], str] = {
    ("model", "f32", False): """
        mat_emission mat_reflectance mat_shininess mat_specular
    """,
    ("model", "f64", False): """
        actuator_armature actuator_cranklength actuator_damping actuator_length0 body_gravcomp
        body_margin body_mass body_subtreemass cam_fovy dof_armature dof_damping dof_frictionloss
        dof_invweight0 dof_length geom_gap geom_margin geom_rbound geom_solmix jnt_margin
        jnt_stiffness key_time pair_gap pair_margin qpos0 qpos_spring sensor_cutoff sensor_noise
        tendon_armature tendon_damping tendon_frictionloss tendon_invweight0 tendon_length0
        tendon_margin tendon_stiffness tendon_width
    """,
    ("model", "int", False): """
        actuator_actadr actuator_actlimited actuator_actnum actuator_biastype actuator_ctrllimited
        actuator_dyntype actuator_forcelimited actuator_gaintype actuator_trntype body_conaffinity
        body_contype body_dofadr body_dofnum body_geomadr body_geomnum body_jntadr body_jntnum
        body_mocapid body_parentid body_rootid body_weldid cam_bodyid dof_bodyid dof_jntid
        dof_parentid eq_active0 eq_obj1id eq_obj2id eq_objtype eq_type geom_bodyid geom_conaffinity
        geom_condim geom_contype geom_group geom_matid geom_priority geom_type jnt_actfrclimited
        jnt_actgravcomp jnt_bodyid jnt_dofadr jnt_limited jnt_qposadr jnt_type light_active
        sensor_adr sensor_dim sensor_type site_bodyid site_group site_matid site_type
        tendon_actfrclimited tendon_adr tendon_limited tendon_num
    """,
    ("model", "f32", True): """
        geom_rgba light_ambient light_diffuse light_specular mat_rgba site_rgba tendon_rgba
    """,
    ("model", "f64", True): """
        actuator_actrange actuator_biasprm actuator_ctrlrange actuator_dynprm actuator_forcerange
        actuator_gainprm actuator_gear actuator_lengthrange actuator_user body_inertia
        body_invweight0 body_ipos body_iquat body_pos body_quat body_user cam_pos cam_quat cam_user
        dof_solimp dof_solref eq_data eq_solimp eq_solref geom_aabb geom_friction geom_pos geom_quat
        geom_size geom_solimp geom_solref geom_user jnt_actfrcrange jnt_axis jnt_pos jnt_range
        jnt_solimp jnt_solref jnt_user key_act key_ctrl key_mpos key_mquat key_qpos key_qvel
        light_dir light_pos pair_friction pair_solimp pair_solref sensor_user site_pos site_quat
        site_size site_user tendon_actfrcrange tendon_lengthspring tendon_range tendon_solimp_fri
        tendon_solimp_lim tendon_solref_fri tendon_solref_lim tendon_user
    """,
    ("model", "int", True): """
        actuator_trnid
    """,
    ("data", "f64", False): """
        act act_dot actuator_force actuator_length actuator_moment actuator_velocity ctrl efc_aref
        efc_D efc_force efc_frictionloss efc_J efc_pos efc_R efc_vel energy M qacc qacc_smooth
        qacc_warmstart qfrc_actuator qfrc_applied qfrc_bias qfrc_constraint qfrc_damper qfrc_fluid
        qfrc_gravcomp qfrc_inverse qfrc_passive qfrc_smooth qfrc_spring qpos qvel sensordata ten_J
        ten_length ten_velocity userdata
    """,
    ("data", "int", False): """
        efc_state efc_type eq_active solver_niter
    """,
    ("data", "f64", True): """
        cacc cam_xmat cam_xpos cdof cfrc_ext cfrc_int cinert cvel efc_KBIP flexvert_xpos geom_xmat
        geom_xpos light_xdir light_xpos mocap_pos mocap_quat site_xmat site_xpos subtree_angmom
        subtree_com subtree_linvel xanchor xaxis xfrc_applied ximat xipos xmat xpos xquat
    """,
}


def _fields() -> Iterator[tuple[tuple[str, ...], ArrayField]]:
    for (owner, element, rows), names in _ARRAYS.items():
        for name in names.split():
            yield (owner, name), ArrayField(element, rows)
    for name in "gravity magnetic o_friction o_solimp o_solref wind".split():
        yield ("model", "opt", name), ArrayField("f64", False)
    yield ("model", "stat", "center"), ArrayField("f64", False)


ARRAYS: dict[tuple[str, ...], ArrayField] = dict(_fields())
"""Arrays by the way to them: `("model", "opt", "gravity")`."""

SIZES = frozenset(
    """
        na nactuator nbody ncam neq nflex nflexvert ngeom njnt nkey nlight nmat nmesh nmocap npair
        nq nsensor nsensordata nsite ntendon nu nuserdata nv
    """.split()
)
"""Numbers of things in a model, which nothing changes."""

_SCALARS = {
    "data": ({"time": "float"} | dict.fromkeys("ncon nefc ne nf nl nisland".split(), "size")),
    "model opt": (
        dict.fromkeys(
            """
                ccd_iterations cone disableactuator disableflags enableflags integrator iterations
                jacobian ls_iterations noslip_iterations sdf_initpoints sdf_iterations solver
            """.split(),
            "int",
        )
        | dict.fromkeys(
            """ccd_tolerance density impratio ls_tolerance noslip_tolerance o_margin
            sleep_tolerance timestep tolerance viscosity""".split(),
            "float",
        )
    ),
    "model stat": dict.fromkeys("extent meaninertia meanmass meansize".split(), "float"),
}
SCALARS: dict[tuple[str, ...], str] = {
    (*owner.split(), name): kind
    for owner, fields in _SCALARS.items()
    for name, kind in fields.items()
}
"""Single numbers by the way to them: `float`, `int`, or `size`, which is only read."""

_STAGES = """
    mj_resetData mj_forward mj_inverse mj_step mj_step1 mj_step2 mj_fwdPosition mj_fwdVelocity
    mj_fwdActuation mj_fwdAcceleration mj_fwdConstraint mj_sensorPos mj_sensorVel mj_sensorAcc
    mj_energyPos mj_energyVel mj_kinematics mj_comPos mj_camlight mj_tendon mj_transmission mj_crb
    mj_collision mj_makeConstraint mj_projectConstraint mj_referenceConstraint mj_comVel mj_passive
    mj_subtreeVel mj_rnePostConstraint mj_setConst
"""
Argument: TypeAlias = Literal["model", "data", "int", "size", "str", "number"]
CALLS: dict[str, tuple[Argument, ...]] = {
    **dict.fromkeys(_STAGES.split(), ("model", "data")),
    "mj_resetDataKeyframe": ("model", "data", "size"),
    "mj_name2id": ("model", "int", "str"),
    "mj_getTotalmass": ("model",),
    "mj_setTotalmass": ("model", "number"),
}
"""Functions and what they take."""
RESULTS = {"mj_name2id": "int", "mj_getTotalmass": "float"}
"""What those give that give something."""
