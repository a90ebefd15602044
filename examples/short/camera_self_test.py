"""A camera measured as a laboratory would (EMVA 1288), beside what its preset says."""

from simgl.assess.emva1288 import camera_under_test, examine
from simgl.gpu.context import open_context

camera = camera_under_test("mt9m034", largest=(160, 120))
with open_context() as ctx:
    report = examine(ctx, camera, levels=30, repeats=4)
ctx.release()
for finding in report.findings:
    print(f"{finding.name:<36} given {finding.configured:10.4g}  found {finding.recovered:10.4g}")
