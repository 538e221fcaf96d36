"""What each score means, in one line, by the group it is shown in; docs/metrics.md has the details."""

from __future__ import annotations

from simrecon.metrics.touch import PARTS

POSITION = {
    "covered": "share of the reference's frames that the motion covers",
    "mpjpe_g_mm": "MPJPE-G: mean distance of 12 joints in the world",
    "mpjpe_mm": "MPJPE: the same with the roots of every frame joined",
    "mpjpe_pa_mm": "MPJPE-PA: the same after the best similarity transform of every frame",
    "mpjpe_g_align1_mm": "MPJPE-G with the roots of the first frame joined (Rempe, Gärtner)",
    "mpjpe_g_rigid1_mm": "MPJPE-G after the rotation and translation that fits the first frame",
    "w_mpjpe_mm": "W-MPJPE: each 100 frames aligned on their first two, with scale (WHAM)",
    "wa_mpjpe_mm": "WA-MPJPE: each 100 frames aligned as a whole, with scale (WHAM)",
    "w_mpjpe_rigid_mm": "W-MPJPE without scale",
    "wa_mpjpe_rigid_mm": "WA-MPJPE without scale",
    "root_mm": "mean distance of the roots, which lie between the hips",
    "rte_pct": "RTE: root error after one rigid alignment, per cent of the way (WHAM)",
    "pck_pct": "PCK: share of root-aligned joints within 150 mm",
    "mpjpe_2d_px": "MPJPE-2d: mean distance of landmarks from the detections in the image",
}
SMOOTHNESS = {
    "velocity_mps": "mean norm of the difference of joint velocities",
    "velocity_gartner_mps": "mean absolute difference of joint speeds at 25 fps (Gärtner eq. 10)",
    "accel_mps2": "mean norm of the difference of joint accelerations",
    "e_smooth_mm": "e_smooth: mean absolute difference of joint steps at 25 fps (Xie eqs. 8–10)",
    "jitter_10mps3": "jitter: mean third derivative of joints at 30 fps, 10 m/s³ (WHAM)",
}
FEET = {
    "foot_contact_frames": "heels and toes at rest in the reference; the next five look at these",
    "footskate_pct": "share of them that move faster than 0.5 m/s",
    "foot_slide_mps": "mean speed of heels and toes there",
    "foot_slide_truth_mps": "the same of the reference",
    "foot_slide_off_mps": "how far the two are apart",
    "foot_height_err_mm": "mean absolute error of their height",
    "footskate_annotated_pct": "frames with a resting foot that moves 2 cm, at 30 fps (Gärtner, annotated)",
    "float_annotated_pct": "frames with a resting foot over 5 mm high, at 30 fps (Gärtner, annotated)",
    "footskate_points_pct": "frames with a heel or toe on the ground that moves 2 cm, at 25 fps (Gärtner)",
    "float_points_pct": "frames with heel and toe over 5 mm, one below 2 cm, at 25 fps (Gärtner)",
    "skate_rempe_pct": "Skate: resting foot points that move 2 cm, at 30 fps (Rempe)",
    "floating_rempe_pct": "Floating: resting foot points over 3 cm high (Rempe)",
    "penetration_rempe_pct": "Penetration: foot points over 3 cm deep, at any time (Rempe)",
    "skate_wham_mm": "foot sliding: mean step where the reference's is below 1 cm, mm a frame (WHAM)",
    "e_foot_z_mm": "e_foot,z: mean absolute error of foot height (Xie eq. 11)",
    "e_foot_vxy_mm": "e_foot,vxy: mean error of horizontal foot steps at 25 fps, mm a frame (Xie eq. 12)",
}
BODY = {
    "body_penetration_mean_mm": "mean depth of the deepest capsule around the joints",
    "body_penetration_max_mm": "greatest such depth",
    "body_penetration_pct": "share of frames with one deeper than 5 mm",
    "contact_f1": "F1 of contact, mean over parts; f1_* of one part",
    "contact_f1_true": "F1 of contact against the forces on a simulated reference, mean over parts",
    "touch_f1": "F1 of touch (within 2 cm, moving or not), mean over parts of the body",
    "touch_f1_least": "that of the worst part",
    **{f"touch_f1_{part}": f"that of the {part.replace('_', ' ')}" for part in PARTS},
    "implied_grf_mean_pct": "mean norm of the force that the motion asks for, % of body weight (Rempe)",
    "implied_grf_max_pct": "its maximum",
    "implied_grf_ballistic_pct": "its median where the reference touches nothing; 0 is right",
}
SIMULATED = {
    "footskate_gartner_pct": "frames with a foot in contact whose ankle moves 2 cm, at 25 fps (Gärtner)",
    "footskate_sole_pct": "frames with a sole's corner in contact that moves 2 cm, at 25 fps",
    "float_gartner_pct": "frames with a foot 5 mm to 2 cm above its support, at 25 fps (Gärtner)",
    "float_body_pct": "frames with a foot below 2 cm while nothing touches, at 25 fps",
    "penetration_mean_mm": "mean depth of the body's lowest point under the ground",
    "penetration_max_mm": "greatest such depth",
    "penetration_pct": "share of frames with a part deeper than 5 mm in ground or items",
    "self_penetration_max_mm": "deepest contact between two parts of the body",
}
FORCES = {
    "grf_vertical_mean_pct": "mean vertical force of the scene, per cent of body weight",
    "grf_mean_pct": "Mean GRF: mean norm of the force of the scene, at 30 fps (Rempe)",
    "grf_max_pct": "Max GRF: greatest norm of the force of the scene, at 30 fps (Rempe)",
    "grf_peak_pct": "greatest force of the scene in a frame of the clip",
    "grf_ballistic_pct": "Ballistic GRF: median force where the reference touches nothing (Rempe)",
    "contact_f1_force": "F1 of contact by force, mean over parts",
    "contact_f1_true_force": "the same against the forces on a simulated reference",
    "touch_f1_force": "F1 of parts pushed by the scene where the reference's are within 2 cm, mean",
    "touch_f1_force_least": "that of the worst part",
    **{f"touch_f1_force_{part}": f"that of the {part.replace('_', ' ')}" for part in PARTS},
    "peak_torque_Nmpkg": "greatest torque of a joint, Nm per kg",
    "peak_power_Wpkg": "greatest power of a joint, W per kg",
    "residual_mean_pct": "force that contact does not explain, mean, per cent of body weight",
    "residual_max_pct": "its maximum",
}
ITEMS = {
    "item_load_pct": "mean vertical force of items, per cent of that of the whole scene",
    "item_sitting_pct": "their mean vertical force while the reference sits still, per cent of body weight",
    "item_standing_pct": "their greatest vertical force while the reference stands, per cent of body weight",
    "rises": "how often they bear the person and then let go for good",
    "reference_rises": "how often the reference rises",
    "item_penetration_max_mm": "greatest depth of the person in an item",
    "sheet_sink_mm": "greatest sink of a mat or trampoline",
    "apex_mm": "greatest height of the centre of mass over its height at the start",
    "apex_s": "when",
}
PLATES = {
    "grf_vertical_mae_pct_bw": "vertical force of the scene against the plates, mean absolute error",
    "grf_vertical_rmse_pct_bw": "its root mean square",
    "grf_corr": "its correlation",
    "grf_mean_pct_bw": "mean vertical force of the scene at these frames",
    "plate_vertical_mae_pct": "vertical force of the feet against the plates, filtered, where known",
    "plate_vertical_rmse_pct": "its root mean square",
    "plate_vertical_corr": "its correlation",
    "plate_peak_error_pct": "greatest vertical force less that of the plates",
    "plate_horizontal_mae_pct": "horizontal components, mean absolute error, filtered",
    "plate_left_mae_pct": "vertical force of the left foot alone",
    "plate_right_mae_pct": "vertical force of the right foot alone",
    "plate_cutoff_hz": "cut-off of the filter: of the reference, at most 80 % of half its frame rate",
    "plate_cop_mm": "mean distance of the feet's centres of pressure from those of the plates",
}
GROUPS = {
    "position": POSITION,
    "velocity and smoothness": SMOOTHNESS,
    "feet, by the reference's contacts": FEET,
    "whole body, by capsules around the joints": BODY,
    "whole body, by its own primitives": SIMULATED,
    "forces of the simulation": FORCES,
    "items of the scene": ITEMS,
    "against force plates, or the forces on a simulated reference, per cent of body weight": PLATES,
}
DEFINITIONS = {name: meaning for group in GROUPS.values() for name, meaning in group.items()}
"""By score, in the order shown."""
