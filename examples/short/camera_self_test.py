"""A camera measured after EMVA 1288, compared with the values of its preset."""

import simgl

camera = simgl.camera_under_test("mt9m034", largest=(160, 120))
with simgl.open_context() as ctx:
    report = simgl.measure_camera(ctx, camera, levels=30, repeats=4)
ctx.release()
for finding in report.findings:
    print(f"{finding.name:<36} given {finding.configured:10.4g}  found {finding.recovered:10.4g}")
