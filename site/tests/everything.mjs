/** A model with one of everything that can be drawn. */

const cube = [0, 1]
  .flatMap((x) => [0, 1].flatMap((y) => [0, 1].map((z) => [x, y, z].map((v) => 0.2 * v - 0.1).join(' '))))
  .join(' ')

const heights = Array.from({ length: 12 }, (_, i) => (i % 5) / 4).join(' ')

export const EVERYTHING = `<mujoco>
  <visual><global azimuth="30" elevation="-40" fovy="50"/><headlight ambient=".2 .3 .4"/></visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1=".3 .5 .7" rgb2="0 0 0" width="16" height="96"/>
    <texture name="checker" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="8" height="8"/>
    <texture name="faces" type="cube" builtin="flat" mark="cross" rgb1=".5 .5 .5" width="4" height="24"/>
    <material name="tiles" texture="checker" texrepeat="3 5" texuniform="true" reflectance=".25" rgba=".1 .2 .3 .4"/>
    <material name="shiny" specular=".75" shininess=".5" emission=".125"/>
    <mesh name="cube" vertex="${cube}"/>
    <mesh name="ball" builtin="sphere" params="1" scale=".1 .1 .1"/>
    <hfield name="hills" nrow="3" ncol="4" size="1 2 .5 .1" elevation="${heights}"/>
  </asset>
  <worldbody>
    <light name="sun" type="directional" pos="0 0 5" dir="0 .6 -.8" castshadow="false" diffuse=".5 .6 .7"/>
    <geom name="floor" type="plane" size="5 6 .1" material="tiles"/>
    <geom name="ground" type="hfield" hfield="hills" pos="8 0 0"/>
    <body name="lamp" pos="0 3 3"><light name="spot" type="spot" pos="0 0 0" dir="0 0 -1" cutoff="30"/><joint name="swing" axis="1 0 0"/>
      <geom size=".05"/><camera name="eye" pos="0 0 .1" xyaxes="0 1 0 0 0 1" fovy="33"/></body>
    <body name="movers" pos="0 0 2"><freejoint/>
      <geom name="sphere" size=".1" pos="1 0 0" rgba="1 .5 .25 1" material="tiles"/>
      <geom name="capsule" type="capsule" size=".1 .2" pos="2 0 0" material="tiles"/>
      <geom name="ellipsoid" type="ellipsoid" size=".1 .2 .3" pos="3 0 0"/>
      <geom name="cylinder" type="cylinder" size=".1 .2" pos="4 0 0" group="3"/>
      <geom name="box" type="box" size=".1 .2 .3" pos="5 0 0" euler="0 0 90"/>
      <geom name="mesh" type="mesh" mesh="cube" pos="6 0 0"/>
      <geom name="sdf" type="sdf" mesh="ball" pos="7 0 0"/>
      <site name="tip" type="box" size=".01 .02 .03" pos="0 0 .5" rgba="0 1 0 .5" group="4"/>
    </body>
    <body name="b0" pos="0 -2 1"><freejoint/><geom size=".05"/><site name="a"/></body>
    <body name="b1" pos="0 -2 2"><freejoint/><geom size=".05"/><site name="b"/></body>
    <flexcomp name="cloth" type="grid" count="4 3 1" spacing=".1 .1 .1" pos="-2 0 2" dim="2" radius=".01"/>
    <flexcomp name="jelly" type="grid" count="3 3 3" spacing=".1 .1 .1" pos="-3 0 2" dim="3" radius=".01" rgba="0 1 1 1"/>
    <flexcomp name="rope" type="grid" count="4 1 1" spacing=".1 .1 .1" pos="-4 0 2" dim="1" radius=".01"/>
  </worldbody>
  <tendon><spatial name="string" width=".01" rgba="1 1 0 1"><site site="a"/><site site="b"/></spatial></tendon>
  <deformable>
    <skin name="hide" rgba="1 0 1 1" vertex="0 -2 1 .1 -2 1 0 -2 2 .1 -2 2" face="0 1 2 1 3 2" texcoord="0 0 1 0 0 1 1 1">
      <bone body="b0" bindpos="0 -2 1" bindquat="1 0 0 0" vertid="0 1" vertweight="1 1"/>
      <bone body="b1" bindpos="0 -2 2" bindquat="1 0 0 0" vertid="2 3" vertweight="1 1"/>
    </skin>
  </deformable>
</mujoco>`
