#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders a scene with more and more samples, and tabulates error against time; then sweeps an exposure of one light and
tabulates what that does to the noise.

Usage: error_against_time.py SCENE [LIGHT_GROUP]
"""
import sys

import velatura

SPP = (4, 8, 16, 32, 64)
STOPS = (-2, -1, 0, 1, 2)
OPTIONS = {"res": (96, 54), "bounces": 2, "halves": True}


def bar(value, largest):
    return "#" * max(1, round(40 * value / largest))


def main(scene, group=None):
    print("error against time")
    frames = [velatura.render(scene, spp=spp, **OPTIONS) for spp in SPP]
    largest = max(frame.error for frame in frames)
    for frame in frames:
        print(f"{frame.spp:6.0f} spp {frame.seconds:7.2f} s {100 * frame.error:7.2f} % {bar(frame.error, largest)}")

    layers = frames[-1].layers
    group = group or layers.groups[0]
    print(f"\nexposure of {group}: mean of the image, and noise of the mix")
    for stops in STOPS:
        gain = {group: f"{stops:+}st"}
        mean = layers.mix(gain=gain)[:, :, :3].mean()
        noise = layers.noise(gain=gain)["mix"]["value"]
        print(f"{stops:+6d} stops {mean:10.4f} {100 * noise:7.2f} %")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(*sys.argv[1:])
