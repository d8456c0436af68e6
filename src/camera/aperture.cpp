// SPDX-License-Identifier: Apache-2.0
#include "camera/aperture.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

namespace velatura::camera {

Aperture::Aperture(int blades, double rotation_deg, double roundness)
    : blades_(blades),
      roundness_(roundness),
      first_edge_(rotation_deg * pi_d / 180 + pi_d / blades),
      half_wedge_(pi_d / blades),
      edge_((1 - roundness) * std::cos(half_wedge_)),
      whole_(integral(half_wedge_)) {
    VELATURA_CHECK(blades >= 3 && roundness >= 0 && roundness <= 1, "no opening of a lens");
}

double Aperture::reach(double angle) const {
    return edge_ / std::cos(angle) + roundness_;
}

double Aperture::integral(double angle) const {
    const double tangent = std::tan(angle);
    // The integral of 1/cos is asinh(tan)
    return edge_ * (edge_ * tangent + 2 * roundness_ * std::asinh(tangent)) +
           roundness_ * roundness_ * angle;
}

double Aperture::area() const {
    return blades_ * whole_;
}

Vec2d Aperture::from_disk(const Vec2d& disk) const {
    const double r = std::sqrt(disk.x * disk.x + disk.y * disk.y);
    if (r == 0.0) return {0.0, 0.0};
    // Which edge, and how far along it in parts of its area, from −1 to 1
    const double around = (std::atan2(disk.y, disk.x) - first_edge_) / (2 * half_wedge_);
    const double edge = std::round(around), along = 2 * (around - edge);
    // The angle at which that part of the area ends. The integral is convex from the middle on:
    // from the second step on, Newton's come down to it from one side
    const double wanted = std::abs(along) * whole_;
    double angle = std::abs(along) * half_wedge_;
    for (int step = 0; step < 8; ++step) {
        const double b = reach(angle);
        const double next = std::min(angle - (integral(angle) - wanted) / (b * b), half_wedge_);
        if (std::abs(next - angle) < 1e-15) break;
        angle = next;
    }
    const double whole_angle = first_edge_ + edge * 2 * half_wedge_ + std::copysign(angle, along);
    const double reached = r * reach(angle);
    return {reached * std::cos(whole_angle), reached * std::sin(whole_angle)};
}

}  // namespace velatura::camera
