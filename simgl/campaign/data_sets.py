"""The further data sets of a campaign: what they cannot hold, and their files."""

from __future__ import annotations

from pathlib import Path

from simgl.campaign.bop_format import check_bop, write_bop
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.frame_task import Format
from simgl.campaign.label_formats import stored_labels
from simgl.campaign.pose_formats import (
    Rows,
    check_rigid,
    check_yolo,
    colmap_camera,
    nerfstudio_camera,
    write_colmap,
    write_masks,
    write_nerfstudio,
    write_yolo,
)
from simgl.campaign.truth_maps import (
    write_colmap_maps,
    write_nerfstudio_depth,
)
from simgl.campaign.webdataset_format import write_webdataset


def check_formats(campaign: Campaign, formats: frozenset[Format]) -> None:
    """Raise ConfigError for what a format cannot hold, before anything is drawn."""
    camera = campaign.scenario.cameras[campaign.camera]
    if Format.BOP in formats:
        check_bop(campaign)
    if Format.COLMAP in formats:
        check_rigid(campaign, "COLMAP")
        colmap_camera(camera)
    if Format.NERFSTUDIO in formats:
        check_rigid(campaign, "nerfstudio")
        nerfstudio_camera(camera)
    if Format.YOLO in formats:
        check_yolo(campaign)


def write_formats(folder: Path, campaign: Campaign, formats: frozenset[Format], rows: Rows) -> None:
    """Write the files of all frames together.

    rows : of the campaign's table, in order
    """
    camera = campaign.scenario.cameras[campaign.camera]
    if Format.BOP in formats:
        labels = stored_labels(folder, campaign.frames)
        write_bop(folder, labels, campaign.scenario.models, camera)
    if formats & {Format.COLMAP, Format.NERFSTUDIO}:
        write_masks(folder, stored_labels(folder, campaign.frames), campaign.target)
    truth = "truth" in campaign.write
    if Format.COLMAP in formats:
        write_colmap(folder, rows, camera)
        if truth and camera.lens.distortion is None:
            write_colmap_maps(folder, campaign)
    if Format.NERFSTUDIO in formats:
        write_nerfstudio(folder, rows, camera, campaign.write[0], depth=truth)
        if truth:
            write_nerfstudio_depth(folder, campaign)
    if Format.WEBDATASET in formats:
        labels = stored_labels(folder, campaign.frames)
        write_webdataset(folder, campaign, labels, rows)
    if Format.YOLO in formats:
        write_yolo(folder, stored_labels(folder, campaign.frames), campaign)
