"""The verdict on a picture: which limit it breaks, the weightiest first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.assess.frame_geometry import FrameGeometry
from simgl.assess.target_background import TargetBackground
from simgl.assess.target_light import FrameAssessment
from simgl.assess.timeline import Moment, timeline
from simgl.assess.verdict import Verdict, verdict
from simgl.scenario.schema import UsabilityCriteria

GOOD = FrameAssessment(
    target="craft",
    range=100.0,
    phase_angle=0.5,
    sun_to_boresight=2.0,
    sunlight=1.0,
    target_pixels=1000,
    saturated=0.01,
    dark=0.1,
    usable=0.89,
    median_snr=40.0,
    cut_off=False,
    size_px=40,
    edge_distance_px=12,
    backdrop=TargetBackground.SPACE,
    contrast=0.9,
    mean_radiance=(10.0, 10.0, 10.0, 10.0),
    relative_flux=500.0,
    median_electrons=4000.0,
    bright_electrons=10000.0,
    full_electrons=20000.0,
    better_exposure=1.8,
    geometry=FrameGeometry(camera_sunlight=1.0),
)
MINUTE = 60_000_000_000


@pytest.mark.parametrize(
    ("change", "expected", "reason"),
    [
        ({}, Verdict.GOOD, None),
        ({"target_pixels": 24}, Verdict.NOT_IN_VIEW, "24 pixels of the target, 25 are needed"),
        ({"saturated": 0.051}, Verdict.TOO_BRIGHT, "5.1 % saturated, 5 % allowed"),
        ({"dark": 0.51}, Verdict.TOO_DARK, "51 % in the noise, 50 % allowed"),
        ({"median_snr": 9.9}, Verdict.TOO_DARK, "signal over noise 9.9, 10 is needed"),
        ({"contrast": 0.05}, Verdict.CONFUSED, "contrast 0.05 to the background, 0.1 needed"),
        ({"contrast": None}, Verdict.GOOD, None),
    ],
)
def test_each_limit_has_its_verdict(
    change: dict[str, float], expected: Verdict, reason: str | None
) -> None:
    judged, reasons = verdict(replace(GOOD, **change), UsabilityCriteria())  # type: ignore[arg-type]
    assert judged is expected
    assert reasons == (() if reason is None else (reason,))


def test_a_picture_with_several_faults_names_them_all() -> None:
    judged, reasons = verdict(replace(GOOD, saturated=0.2, contrast=0.0), UsabilityCriteria())
    assert judged is Verdict.TOO_BRIGHT
    assert len(reasons) == 2


def test_limits_are_those_of_the_scenario() -> None:
    limits = UsabilityCriteria(min_snr=50.0)
    assert verdict(GOOD, limits)[0] is Verdict.TOO_DARK
    assert verdict(GOOD, replace(limits, min_snr=40.0))[0] is Verdict.GOOD


def moments(*verdicts: Verdict, **changes: float) -> list[Moment]:
    values = {"phase_angle": 1.0, "sunlight": 1.0, "usable": 0.9, "median_snr": 30.0} | changes
    return [
        Moment(tai_ns=index * MINUTE, verdict=one, better_exposure=0.25, **values)
        for index, one in enumerate(verdicts)
    ]


def test_windows_and_shares_add_up() -> None:
    g, b = Verdict.GOOD, Verdict.TOO_BRIGHT
    found = timeline(moments(g, g, b, g, g, g, b, b))
    assert [(w.verdict, w.epochs) for w in found.windows] == [(g, 2), (b, 1), (g, 3), (b, 2)]
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert found.shares[g] == pytest.approx(5 / 8)
    assert [w.duration for w in found.best] == pytest.approx([120.0, 60.0])
    assert found.best[0].start_ns == 3 * MINUTE


def test_advice_says_what_would_help() -> None:
    bright = timeline(moments(Verdict.TOO_BRIGHT, Verdict.TOO_BRIGHT, Verdict.GOOD)).advice
    assert any("an exposure 4 times shorter would suit them" in text for text in bright)
    dark = timeline(moments(Verdict.TOO_DARK, Verdict.GOOD, sunlight=0.0)).advice
    assert any("Earth's shadow" in text for text in dark)
    confused = timeline(moments(Verdict.CONFUSED, Verdict.GOOD)).advice
    assert any("do not stand out" in text for text in confused)
    angles = timeline(moments(Verdict.GOOD, Verdict.TOO_DARK, phase_angle=np.radians(40.0))).advice
    assert any("phase angles of 40 to 40 deg" in text for text in angles)
    assert timeline(moments(Verdict.GOOD, Verdict.GOOD)).advice == ()


def test_the_worst_epoch_is_one_in_view() -> None:
    found = timeline(moments(Verdict.NOT_IN_VIEW, Verdict.GOOD))
    assert found.worst is not None
    assert found.worst.tai_ns == MINUTE
    assert timeline(moments(Verdict.NOT_IN_VIEW)).worst is None
