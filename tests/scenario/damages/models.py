"""Models, primitives and materials of a spacecraft: damaged, and what is said of it."""

from __future__ import annotations

from tests.scenario.damages.damage import MODEL, ORBIT, PLACE, PLATE, Damage

DAMAGES = (
    Damage(
        "scenario in place of a model card",
        MODEL,
        'model = "./scene.toml"',
        ": epoch is not a key here; allowed: axes, description, file, joint, keypoints, name, "
        "reflectance, source, thermal, thermal_link, thermal_node, unit_m",
    ),
    Damage(
        "unknown key of a primitive",
        "width_m = 1.0",
        "widht_m = 1.0",
        ' [spacecraft.plate]: model.plate.widht_m is not a key here; did you mean "width_m"? '
        "(allowed: height_m, material, width_m)",
    ),
    Damage(
        "unknown key of a material",
        "{ reflectance = 0.5 }",
        "{ reflectance = 0.5, rough = 0.2 }",
        " [spacecraft.plate]: model.plate.material.rough is not a key here; did you mean "
        '"roughness"? (allowed: cells, coat, conserving, crinkle, emission_w_m2_sr, metallic, '
        "reflectance, roughness, thermal)",
    ),
    Damage(
        "unknown primitive",
        "model.plate",
        "model.cone",
        " [spacecraft.plate]: model.cone is not a key here; allowed: box, cylinder, plate, sphere",
    ),
    Damage(
        "text for a number",
        "width_m = 1.0",
        'width_m = "1 m"',
        ' [spacecraft.plate]: model.plate.width_m must be a number, got "1 m"',
    ),
    Damage(
        "true for a number",
        "width_m = 1.0",
        "width_m = true",
        " [spacecraft.plate]: model.plate.width_m must be a number, got true",
    ),
    Damage(
        "orbit as a list",
        ORBIT,
        "orbit = [400.0]",
        " [spacecraft.chaser]: orbit must be a table of altitude_km, "
        "semi_major_axis_km, eccentricity, inclination_deg, raan_deg, argument_of_perigee_deg, "
        "true_anomaly_deg, j2, got [400.0]",
    ),
    Damage(
        "three bands",
        "reflectance = 0.5",
        "reflectance = [0.5, 0.5, 0.5]",
        " [spacecraft.plate]: model.plate.material.reflectance must be a list of length 4, got "
        "[0.5, 0.5, 0.5]",
    ),
    Damage(
        "truth for bands",
        "reflectance = 0.5",
        "reflectance = true",
        " [spacecraft.plate]: model.plate.material.reflectance must be a number or a text or a "
        "list, got true",
    ),
    Damage(
        "number for a model",
        MODEL,
        "model = 12",
        " [spacecraft.chaser]: model must be a text or a table of plate, sphere, "
        "box, cylinder, got 12",
    ),
    Damage(
        "nan",
        "width_m = 1.0",
        "width_m = nan",
        " [spacecraft.plate]: model.plate.width_m must be finite, got nan",
    ),
    Damage(
        "negative length",
        "width_m = 1.0",
        "width_m = -1.0",
        " [spacecraft.plate]: model.plate.width_m must be a number > 0.0, got -1.0",
    ),
    Damage(
        "zero length",
        "height_m = 1.0",
        "height_m = 0",
        " [spacecraft.plate]: model.plate.height_m must be a number > 0.0, got 0",
    ),
    Damage(
        "reflectance above one",
        "reflectance = 0.5",
        "reflectance = 1.5",
        " [spacecraft.plate]: model.plate.material.reflectance must lie in 0..1, got 1.5",
    ),
    Damage(
        "unknown finish",
        "{ reflectance = 0.5 }",
        '"white_pant"',
        ' [spacecraft.plate]: model.plate.material names no finish "white_pant"; did you mean '
        '"white_paint"? (allowed: bare_aluminium, black_paint, cell_under_glass, lambert_02, '
        "lambert_05, lambert_09, lambert_12, lambert_18, lambert_25, lambert_36, lambert_45, "
        "lambert_60, lambert_75, lambert_90, lambert_99, lambert_white, "
        "mirror, mli_gold, mli_silver, solar_cell, white_paint)",
    ),
    Damage(
        "number for a material",
        "{ reflectance = 0.5 }",
        "0.5",
        " [spacecraft.plate]: model.plate.material must be a text or a table of reflectance, "
        "metallic, roughness, conserving, coat, cells, crinkle, emission_w_m2_sr, thermal, "
        "got 0.5",
    ),
    Damage(
        "more than a whole coat",
        "reflectance = 0.5",
        "reflectance = 0.5, coat = { strength = 1.1 }",
        " [spacecraft.plate]: model.plate.material.coat.strength must be a number "
        ">= 0.0, <= 1.0, got 1.1",
    ),
    Damage(
        "coat too smooth",
        "reflectance = 0.5",
        "reflectance = 0.5, coat = { roughness = 0.0 }",
        " [spacecraft.plate]: model.plate.material.coat.roughness must be a number "
        ">= 0.01, <= 1.0, "
        "got 0.0",
    ),
    Damage(
        "crinkle without facets",
        "reflectance = 0.5",
        "reflectance = 0.5, crinkle = { slope = 0.1 }",
        " [spacecraft.plate]: model.plate.material.crinkle.facet_size_m is missing",
    ),
    Damage(
        "unknown key of a crinkle",
        "reflectance = 0.5",
        "reflectance = 0.5, crinkle = { facet_size = 0.02, slope = 0.1 }",
        " [spacecraft.plate]: model.plate.material.crinkle.facet_size is not a key here; did you "
        'mean "facet_size_m"? (allowed: facet_size_m, slope)',
    ),
    Damage(
        "absorptance above 1",
        "reflectance = 0.5",
        "reflectance = 0.5, thermal = { solar_absorptance = 1.2, infrared_emissivity = 0.9 }",
        " [spacecraft.plate]: model.plate.material.thermal.solar_absorptance must be a number "
        ">= 0.0, <= 1.0, got 1.2",
    ),
    Damage(
        "thermal properties without emissivity",
        "reflectance = 0.5",
        "reflectance = 0.5, thermal = { solar_absorptance = 0.2 }",
        " [spacecraft.plate]: model.plate.material.thermal.infrared_emissivity is missing",
    ),
    Damage(
        "facets too steep",
        "reflectance = 0.5",
        "reflectance = 0.5, crinkle = { facet_size_m = 0.02, slope = 2.0 }",
        " [spacecraft.plate]: model.plate.material.crinkle.slope must be a number "
        ">= 0.0, <= 1.0, got 2.0",
    ),
    Damage(
        "cells without height",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04 }",
        " [spacecraft.plate]: model.plate.material.cells.height_m is missing",
    ),
    Damage(
        "fingers wider than their pitch",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04, height_m = 0.08, finger_pitch_m = 0.001, "
        "finger_width_m = 0.002 }",
        " [spacecraft.plate]: model.plate.material.cells.finger_width_m must be less than "
        "finger_pitch_m = 0.001, got 0.002",
    ),
    Damage(
        "gap brighter than white",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04, height_m = 0.08, gap_reflectance = 1.5 }",
        " [spacecraft.plate]: model.plate.material.cells.gap_reflectance must lie in 0..1, got 1.5",
    ),
    Damage(
        "mirror too smooth",
        "reflectance = 0.5",
        "reflectance = 0.5, roughness = 0.001",
        " [spacecraft.plate]: model.plate.material.roughness must be a number "
        ">= 0.01, <= 1.0, got 0.001",
    ),
    Damage(
        "more than metal",
        "reflectance = 0.5",
        "reflectance = 0.5, metallic = 1.5",
        " [spacecraft.plate]: model.plate.material.metallic must be a number "
        ">= 0.0, <= 1.0, got 1.5",
    ),
    Damage("no model", f"{PLATE}\n", "", " [spacecraft.plate]: model is missing"),
    Damage(
        "empty model",
        PLATE,
        "model = {}",
        " [spacecraft.plate]: model needs exactly one of plate, sphere, box, cylinder; got none "
        "of them",
    ),
    Damage(
        "two primitives",
        PLATE,
        PLATE + "\nmodel.sphere = { radius_m = 1.0, material = { reflectance = 0.5 } }",
        " [spacecraft.plate]: model needs exactly one of plate, sphere, box, cylinder; got plate "
        "and sphere",
    ),
    Damage(
        "metal without roughness",
        "reflectance = 0.5",
        "reflectance = 0.5, metallic = 1.0",
        " [spacecraft.plate]: model.plate.material.metallic requires roughness; without it the "
        "material is Lambertian",
    ),
    Damage(
        "conserving without roughness",
        "reflectance = 0.5",
        "reflectance = 0.5, conserving = true",
        " [spacecraft.plate]: model.plate.material.conserving requires roughness; without it the "
        "material is Lambertian",
    ),
    Damage(
        "gap without a width",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04, height_m = 0.08, gap_reflectance = 0.5 }",
        " [spacecraft.plate]: model.plate.material.cells.gap_reflectance requires gap_m above 0",
    ),
    Damage(
        "metal without lines",
        "reflectance = 0.5",
        "reflectance = 0.5, cells = { width_m = 0.04, height_m = 0.08, metal_reflectance = 0.5 }",
        " [spacecraft.plate]: model.plate.material.cells.metal_reflectance requires "
        "finger_width_m or busbar_width_m above 0",
    ),
    Damage(
        "material without reflectance",
        "reflectance = 0.5",
        "metallic = 1.0",
        " [spacecraft.plate]: model.plate.material.reflectance is missing",
    ),
    Damage(
        "unit of a primitive",
        PLACE,
        f"{PLACE}\nunit_m = 0.001",
        " [spacecraft.plate]: unit_m is allowed only for a mesh file; a primitive is in metres "
        "and body axes",
    ),
    Damage(
        "unit that is none",
        MODEL,
        f'{MODEL}\nunit = "yd"',
        ' [spacecraft.chaser]: unit must be one of "cm", "ft", "in", "km", "m", "mm", got "yd"',
    ),
    Damage(
        "two units",
        MODEL,
        f'{MODEL}\nunit = "mm"\nunit_m = 0.001',
        " [spacecraft.chaser]: unit_m contradicts unit; give one of them",
    ),
    Damage(
        "axis that is none",
        MODEL,
        f'{MODEL}\nup_axis = "w"',
        ' [spacecraft.chaser]: up_axis must be one of "-x", "-y", "-z", "x", "y", "z", got "w"',
    ),
    Damage(
        "up and ahead along one axis",
        MODEL,
        f'{MODEL}\nup_axis = "y"\nforward_axis = "-y"',
        " [spacecraft.chaser]: forward_axis must not lie along up_axis, got -y and y",
    ),
    Damage(
        "ahead without a way up",
        MODEL,
        f'{MODEL}\nforward_axis = "y"',
        " [spacecraft.chaser]: forward_axis requires up_axis",
    ),
    Damage(
        "axes of a primitive",
        PLACE,
        f'{PLACE}\nup_axis = "y"',
        " [spacecraft.plate]: up_axis is allowed only for a mesh file; a primitive is in metres "
        "and body axes",
    ),
    Damage(
        "unit of zero",
        MODEL,
        f"{MODEL}\nunit_m = 0.0",
        " [spacecraft.chaser]: unit_m must be a number > 0.0, got 0.0",
    ),
)
