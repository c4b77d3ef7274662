"""What of MuJoCo lab code can use and have translated: names of the bindings and their types.

Entry points: `ARRAYS`, `SCALARS`, `CALLS`.

In JavaScript every array is flat, in Python one of several numbers a row has two dimensions. These
are the arrays of floats, whole numbers or booleans that both bindings give in the same size. Left
out are bytes, which wrap when they are assigned to, numbers of 64 bits, which JavaScript does not
have, and what plugins keep. A test holds these tables against both bindings, and fails where one is
missing.
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
        hfield_data light_bulbradius light_cutoff light_exponent light_intensity light_range
        light_softness mat_emission mat_metallic mat_reflectance mat_roughness mat_shininess
        mat_specular skin_bonevertweight skin_inflate
    """,
    ("model", "f64", False): """
        actuator_acc0 actuator_armature actuator_cranklength actuator_damping actuator_delay
        actuator_length0 body_gravcomp body_margin body_mass body_subtreemass cam_fovy cam_ipd
        dof_M0 dof_armature dof_damping dof_frictionloss dof_invweight0 dof_length efm0_L
        flex_bending flex_damping flex_edgedamping flex_edgestiffness flex_gap flex_margin
        flex_radius flex_solmix flex_stiffness flexedge_invweight0 flexedge_length0 geom_adhesion
        geom_gap geom_margin geom_rbound geom_solmix jnt_margin jnt_stiffness key_time numeric_data
        pair_adhesion pair_gap pair_margin qpos0 qpos_spring sensor_cutoff sensor_delay sensor_noise
        tendon_armature tendon_damping tendon_frictionloss tendon_invweight0 tendon_length0
        tendon_margin tendon_stiffness tendon_width tuple_objprm wrap_prm
    """,
    ("model", "int", False): """
        B_colind B_rowadr B_rownnz D_colind D_diag D_rowadr D_rownnz M_colind M_rowadr M_rownnz
        actuator_actadr actuator_actearly actuator_actlimited actuator_actnum actuator_biastype
        actuator_ctrladr actuator_ctrllimited actuator_ctrlnum actuator_ctrlspec actuator_dyntype
        actuator_forcelimited actuator_gaintype actuator_group actuator_historyadr actuator_outadr
        actuator_outnum actuator_plugin actuator_trntype body_bvhadr body_bvhnum body_conaffinity
        body_contype body_dofadr body_dofnum body_geomadr body_geomnum body_jntadr body_jntnum
        body_mocapid body_parentid body_plugin body_rootid body_treeid body_weldid bvh_depth
        bvh_nodeid cam_bodyid cam_mode cam_output cam_projection cam_targetbodyid dof_Madr
        dof_bodyid dof_jntid dof_parentid dof_simplenum dof_treeid efm0_L_colind efm0_L_rowadr
        efm0_L_rownnz efm0_dofid eq_active0 eq_obj1id eq_obj2id eq_objtype eq_type exclude_signature
        flex_activelayers flex_bendingadr flex_bvhadr flex_bvhnum flex_centered flex_conaffinity
        flex_condim flex_contype flex_dim flex_edgeadr flex_edgeequality flex_edgenum flex_elem
        flex_elemadr flex_elemdataadr flex_elemedge flex_elemedgeadr flex_elemlayer flex_elemnum
        flex_elemtexcoord flex_evpairadr flex_evpairnum flex_flatskin flex_group flex_internal
        flex_interp flex_matid flex_nodeadr flex_nodebodyid flex_nodenum flex_passive flex_priority
        flex_rigid flex_selfcollide flex_shell flex_shelldataadr flex_shellnum flex_stiffnessadr
        flex_texcoordadr flex_vertadr flex_vertbodyid flex_vertedgeadr flex_vertedgenum flex_vertnum
        flexedge_J_colind flexedge_J_rowadr flexedge_J_rownnz flexedge_rigid geom_bodyid
        geom_conaffinity geom_condim geom_contype geom_dataid geom_group geom_matid geom_plugin
        geom_priority geom_type hfield_adr hfield_ncol hfield_nrow hfield_pathadr jnt_actfrclimited
        jnt_actgravcomp jnt_actuatorid jnt_bodyid jnt_dofadr jnt_group jnt_limited jnt_qposadr
        jnt_type light_active light_bodyid light_castshadow light_mode light_targetbodyid
        light_texid light_type mapD2M mapM2D mapM2M mat_texuniform mesh_bvhadr mesh_bvhnum
        mesh_faceadr mesh_facenum mesh_graph mesh_graphadr mesh_normaladr mesh_normalnum mesh_octadr
        mesh_octnum mesh_pathadr mesh_polyadr mesh_polymap mesh_polymapadr mesh_polymapnum
        mesh_polynum mesh_polyvert mesh_polyvertadr mesh_polyvertnum mesh_texcoordadr
        mesh_texcoordnum mesh_vertadr mesh_vertnum name_actuatoradr name_bodyadr name_camadr
        name_eqadr name_excludeadr name_flexadr name_geomadr name_hfieldadr name_jntadr name_keyadr
        name_lightadr name_matadr name_meshadr name_numericadr name_pairadr name_pluginadr
        name_sensoradr name_siteadr name_skinadr name_tendonadr name_texadr name_textadr
        name_tupleadr names_map numeric_adr numeric_size oct_depth pair_dim pair_geom1 pair_geom2
        pair_signature sensor_adr sensor_datatype sensor_dim sensor_historyadr sensor_needstage
        sensor_objid sensor_objtype sensor_plugin sensor_refid sensor_reftype sensor_type
        site_bodyid site_dataid site_group site_matid site_type skin_boneadr skin_bonebodyid
        skin_bonenum skin_bonevertadr skin_bonevertid skin_bonevertnum skin_faceadr skin_facenum
        skin_group skin_matid skin_pathadr skin_texcoordadr skin_vertadr skin_vertnum ten_J_colind
        ten_J_rowadr ten_J_rownnz tendon_actfrclimited tendon_actuatorid tendon_adr tendon_group
        tendon_limited tendon_matid tendon_num tendon_treenum tex_colorspace tex_height tex_nchannel
        tex_pathadr tex_type tex_width text_adr text_size tree_bodyadr tree_bodynum tree_dofadr
        tree_dofnum tree_sleep_policy tuple_adr tuple_objid tuple_objtype tuple_size wrap_objid
        wrap_type
    """,
    ("model", "f32", True): """
        cam_intrinsic cam_sensorsize flex_rgba flex_texcoord geom_rgba light_ambient
        light_attenuation light_diffuse light_specular mat_rgba mat_texrepeat mesh_normal
        mesh_texcoord mesh_vert site_rgba skin_bonebindpos skin_bonebindquat skin_rgba skin_texcoord
        skin_vert tendon_rgba
    """,
    ("model", "f64", True): """
        actuator_actrange actuator_biasprm actuator_ctrlrange actuator_dampingpoly actuator_dynprm
        actuator_forcerange actuator_gainprm actuator_gear actuator_lengthrange actuator_user
        body_inertia body_invweight0 body_ipos body_iquat body_pos body_quat body_user bvh_aabb
        cam_mat0 cam_pos cam_pos0 cam_poscom0 cam_quat cam_user dof_dampingpoly dof_solimp
        dof_solref eq_data eq_solimp eq_solref flex_friction flex_node flex_node0 flex_size
        flex_solimp flex_solref flex_vert flex_vert0 flex_vertmetric geom_aabb geom_fluid
        geom_friction geom_pos geom_quat geom_size geom_solimp geom_solref geom_surfacevel geom_user
        hfield_size jnt_actfrcrange jnt_axis jnt_pos jnt_range jnt_solimp jnt_solref
        jnt_stiffnesspoly jnt_user key_act key_ctrl key_mpos key_mquat key_qpos key_qvel light_dir
        light_dir0 light_pos light_pos0 light_poscom0 mesh_polynormal mesh_pos mesh_quat mesh_scale
        oct_aabb oct_coeff pair_friction pair_solimp pair_solref pair_solreffriction sensor_interval
        sensor_user site_pos site_quat site_size site_user tendon_actfrcrange tendon_dampingpoly
        tendon_lengthspring tendon_range tendon_solimp_fri tendon_solimp_lim tendon_solref_fri
        tendon_solref_lim tendon_stiffnesspoly tendon_user
    """,
    ("model", "int", True): """
        actuator_history actuator_trnid bvh_child cam_resolution flex_cellnum flex_edge
        flex_edgeflap flex_evpair flex_vertedge flexvert_J_colind flexvert_J_rowadr
        flexvert_J_rownnz mat_texid mesh_extrema mesh_face mesh_facenormal mesh_facetexcoord
        oct_child sensor_history sensor_intprm skin_face tendon_treeid
    """,
    ("data", "f64", False): """
        M act act_dot actuator_force actuator_length actuator_moment actuator_velocity ctrl efc_AR
        efc_D efc_J efc_R efc_Y efc_aref efc_b efc_diagA efc_force efc_frictionloss efc_margin
        efc_pos efc_vel efm_K_val efm_L efm_ak efm_as efm_c efm_ca efm_ck efm_con_val efm_diag
        efm_fluid efm_sdiag efm_tk efm_ts energy flexedge_J flexedge_length flexedge_velocity
        flexelem_krot flexvert_lambda history iacc iacc_smooth iefc_D iefc_R iefc_aref iefc_force
        iefc_frictionloss ifrc_constraint ifrc_smooth qDeriv qH qHDiagInv qLD qLDiagInv qLU qacc
        qacc_smooth qacc_warmstart qfrc_actuator qfrc_adhesion qfrc_applied qfrc_bias
        qfrc_constraint qfrc_damper qfrc_fluid qfrc_gravcomp qfrc_inverse qfrc_passive qfrc_smooth
        qfrc_spring qpos qvel sensordata solver_fwdinv ten_J ten_length ten_velocity userdata
    """,
    ("data", "int", False): """
        body_awake body_awake_ind bvh_active dof_awake_ind dof_island efc_AR_colind efc_AR_rowadr
        efc_AR_rownnz efc_J_colind efc_J_rowadr efc_J_rownnz efc_J_rowsuper efc_Y_colind
        efc_Y_rowadr efc_Y_rownnz efc_id efc_island efc_state efc_type efm_K_colind efm_K_rowadr
        efm_K_rownnz efm_aid efm_con_ind efm_dofid efm_tid eq_active flexvert_conage iefc_id
        iefc_state iefc_type island_dofadr island_idofadr island_iefcadr island_itreeadr island_ne
        island_nefc island_nf island_ntree island_nv map_dof2idof map_efc2iefc map_idof2dof
        map_iefc2efc map_itree2tree moment_colind moment_rowadr moment_rownnz parent_awake_ind
        solver_niter solver_nnz ten_wrapadr ten_wrapnum tendon_efcadr tree_asleep tree_awake
        tree_island
    """,
    ("data", "f64", True): """
        bvh_aabb_dyn cacc cam_xmat cam_xpos cdof cdof_dot cfrc_ext cfrc_int cinert crb cvel efc_KBIP
        flexelem_aabb flexvert_J flexvert_length flexvert_xpos geom_xmat geom_xpos light_xdir
        light_xpos mocap_pos mocap_quat site_xmat site_xpos subtree_angmom subtree_com
        subtree_linvel wrap_xpos xanchor xaxis xfrc_applied ximat xipos xmat xpos xquat
    """,
    ("data", "int", True): """
        wrap_obj
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
        nB nC nD nJfe nJfv nJmom nJten nM na nactuator nbody nbvh nbvhdynamic nbvhstatic ncam
        nconmax nefm0L nefm0dof nemax neq nexclude nflex nflexbending nflexedge nflexelem
        nflexelemdata nflexelemedge nflexevpair nflexnode nflexshelldata nflexstiffness
        nflextexcoord nflexvert ngeom ngravcomp nhfield nhfielddata nhistory njmax njnt nkey nlight
        nmat nmesh nmeshdegmax nmeshface nmeshgraph nmeshnormal nmeshpoly nmeshpolymap nmeshpolyvert
        nmeshtexcoord nmeshvert nmocap nnames nnames_map nnumeric nnumericdata noct nout npair
        npaths nplugin npluginattr npluginstate npolygonmax nq nsensor nsensordata nsite nskin
        nskinbone nskinbonevert nskinface nskintexvert nskinvert ntendon ntex ntexdata ntext
        ntextdata ntree ntuple ntupledata nu nuser_actuator nuser_body nuser_cam nuser_geom
        nuser_jnt nuser_sensor nuser_site nuser_tendon nuserdata nv nwrap
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
