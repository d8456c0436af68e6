# SPDX-License-Identifier: Apache-2.0
"""Clear sky after Preetham, Shirley, Smits 1999, "A Practical Analytic Model for Daylight", SIGGRAPH; appendix A.2."""
import math


def perez(theta, gamma, c):
    """The five-parameter sky distribution, F of equation 3."""
    return (1 + c[0] * math.exp(c[1] / max(math.cos(theta), 0.01))) * (
        1 + c[2] * math.exp(c[3] * gamma) + c[4] * math.cos(gamma) ** 2)


def xyY_to_rgb(x, y, Y):
    """CIE xyY to linear Rec.709 (IEC 61966-2-1 matrix)."""
    X, Z = x / y * Y, (1 - x - y) / y * Y
    return (3.2406 * X - 1.5372 * Y - 0.4986 * Z,
            -0.9689 * X + 1.8758 * Y + 0.0415 * Z,
            0.0557 * X - 0.2040 * Y + 1.0570 * Z)


class Sky:
    """Radiance of the sky, scaled so that the zenith has luminance 1.

    sun_elevation_deg above the horizon; sun_azimuth_deg from +z towards +x; turbidity 2 (clear) … 6 (hazy).
    """

    def __init__(self, sun_elevation_deg, sun_azimuth_deg, turbidity):
        t, s = turbidity, math.radians(90 - sun_elevation_deg)
        self.theta_sun = s
        elevation, azimuth = math.radians(sun_elevation_deg), math.radians(sun_azimuth_deg)
        self.sun = (math.cos(elevation) * math.sin(azimuth), math.sin(elevation), math.cos(elevation) * math.cos(azimuth))
        self.perez_Y = (0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771, -0.0670 * t + 0.3703)
        self.perez_x = (-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989, -0.0033 * t + 0.0452)
        self.perez_y = (-0.0167 * t - 0.2608, -0.0950 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537, -0.0109 * t + 0.0529)
        self.zenith_x = (t * t * (0.00166 * s ** 3 - 0.00375 * s ** 2 + 0.00209 * s)
                         + t * (-0.02903 * s ** 3 + 0.06377 * s ** 2 - 0.03202 * s + 0.00394)
                         + 0.11693 * s ** 3 - 0.21196 * s ** 2 + 0.06052 * s + 0.25886)
        self.zenith_y = (t * t * (0.00275 * s ** 3 - 0.00610 * s ** 2 + 0.00317 * s)
                         + t * (-0.04214 * s ** 3 + 0.08970 * s ** 2 - 0.04153 * s + 0.00516)
                         + 0.15346 * s ** 3 - 0.26756 * s ** 2 + 0.06670 * s + 0.26688)

    def radiance(self, direction):
        """Linear Rec.709 in a unit direction at or above the horizon; without the sun's disc."""
        theta = math.acos(min(max(direction[1], 0.0), 1.0))
        gamma = math.acos(min(max(sum(a * b for a, b in zip(direction, self.sun)), -1.0), 1.0))

        def channel(c, zenith):
            return zenith * perez(theta, gamma, c) / perez(0.0, self.theta_sun, c)

        rgb = xyY_to_rgb(channel(self.perez_x, self.zenith_x), channel(self.perez_y, self.zenith_y), channel(self.perez_Y, 1.0))
        return tuple(max(c, 0.0) for c in rgb)


def lat_long_direction(x, y, width, height):
    """Direction of a pixel's center: top row up (+y), center column +z, left of it +x (OpenEXR's latitude-longitude map)."""
    latitude = math.pi * (0.5 - (y + 0.5) / height)
    longitude = 2 * math.pi * (0.5 - (x + 0.5) / width)
    return (math.cos(latitude) * math.sin(longitude), math.sin(latitude), math.cos(latitude) * math.cos(longitude))
