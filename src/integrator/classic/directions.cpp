// SPDX-License-Identifier: Apache-2.0
#include "integrator/classic/directions.h"

#include "sampling/warp.h"

namespace velatura::integrator::classic {

namespace {

/// from_square: of a direction around +Z.
template <class FromSquare, class Pdf>
LightDirection over_hemispheres(const lights::Receiver& from,
                                const Vec2& u,
                                const FromSquare& from_square,
                                const Pdf& pdf_of) {
    if (from.n == Vec3(0.0f)) return {sampling::uniform_sphere(u), sampling::uniform_sphere_pdf};
    // One of the two sides, by what is left of the number
    const bool is_behind = from.both_sides && u.x >= 0.5f;
    const Vec2 inside(from.both_sides ? 2.0f * u.x - float(is_behind) : u.x, u.y);
    const Vec3 local = from_square(inside);
    const float pdf = pdf_of(local.z);
    const Vec3 axis = is_behind ? -from.n : from.n;
    return {Frame::from_z(axis).from_local(local), from.both_sides ? 0.5f * pdf : pdf};
}

}  // namespace

LightDirection uniform_direction(const lights::Receiver& from, const Vec2& u) {
    return over_hemispheres(
        from, u, [](const Vec2& v) { return sampling::uniform_hemisphere(v); },
        [](float) { return sampling::uniform_hemisphere_pdf; });
}

LightDirection cosine_direction(const lights::Receiver& from, const Vec2& u) {
    return over_hemispheres(
        from, u, [](const Vec2& v) { return sampling::cosine_hemisphere(v); },
        [](float cosine) { return sampling::cosine_hemisphere_pdf(cosine); });
}

}  // namespace velatura::integrator::classic
