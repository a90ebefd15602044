"""Draw a campaign's COCO labels over its images: mask outline, box, keypoints.

Run with: python -m examples.campaign.overlay FOLDER FRAME PICTURE.png [GAIN]
Green keypoints are seen, red ones hidden by a spacecraft.
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw


def main(folder: Path, frame: int, out: Path, gain: float = 4.0) -> None:
    labels = json.loads((folder / "coco.json").read_text())
    image = next(one for one in labels["images"] if one["id"] == frame)
    names = {one["id"]: one["keypoints"] for one in labels["categories"]}
    (dn8_file,) = folder.glob(f"dn8/{image['file_name']}")
    grey = np.clip(gain * np.asarray(Image.open(dn8_file), dtype=float), 0, 255).astype(np.uint8)
    sheet = Image.fromarray(grey).convert("RGB")
    pen = ImageDraw.Draw(sheet)
    for label in labels["annotations"]:
        if label["image_id"] != frame:
            continue
        counts, (height, width) = label["segmentation"]["counts"], label["segmentation"]["size"]
        inside = np.arange(len(counts)) % 2 == 1
        mask = np.repeat(inside, counts).reshape(width, height).T
        edge = mask & ~(np.roll(mask, 1, 0) & np.roll(mask, -1, 0) & np.roll(mask, 1, 1))
        pen.bitmap((0, 0), Image.fromarray(np.uint8(255 * edge)), fill="#3070ff")
        x, y, w, h = label["bbox"]
        pen.rectangle((x, y, x + w - 1, y + h - 1), outline="#ffd000")
        points = np.reshape(label["keypoints"], (-1, 3))
        for name, (px, py, seen) in zip(names[label["category_id"]], points, strict=True):
            if seen:
                colour = "#20e060" if seen == 2 else "#ff4040"
                pen.ellipse((px - 3, py - 3, px + 3, py + 3), outline=colour)
                pen.text((px + 5, py - 5), name, fill=colour)
    sheet.save(out)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]), *map(float, sys.argv[4:5]))
