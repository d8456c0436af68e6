// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/texture.h"

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace velatura::scene {

/// A box with round corners and soft edges, in filter space. Without depth (lower.z = upper.z = 0)
/// a rectangle. The radius enlarges the box, the edges lie around that.
struct RoundedBox {
    Vec3 lower = Vec3(-0.5f), upper = Vec3(0.5f);
    float radius = 0.0f;
    Vec3 scale = Vec3(1.0f);  ///< of box and radius; edges keep their width
    float edge = 0.0f;        ///< width over which the box fades to nothing; 0 = hard
    Vec3 edge_lower = Vec3(1.0f), edge_upper = Vec3(1.0f);  ///< factor of `edge`, by side
};

/// How a point on the plane z = 0 of a filter is found for a receiver.
struct FilterProjection {
    enum class Kind : uint8_t {
        Segment,   ///< where the segment from the light to the receiver crosses the plane: physical
        Point,     ///< in line with the apex, (0, 0, apex)
        Parallel,  ///< along z
    };
    /// What receivers before the plane get, which no light reaches through it.
    enum class Before : uint8_t { Unfiltered, Extended, Black };

    Kind kind = Kind::Segment;
    float apex = 1.0f;  ///< Point: > 0
    Before before = Before::Unfiltered;
};

/// The same everywhere: tint and saturation alone.
struct IntensityFilter {};

/// Colors by distance.
struct RampFilter {
    enum class Measure : uint8_t {
        ToLight,    ///< from the receiver to the point of the light [scene units]
        AlongAxis,  ///< of the receiver from the origin, along −z
        FromPoint,  ///< of the receiver from the origin
        FromAxis,   ///< of the receiver from the z axis
    };
    enum class Interpolation : uint8_t { Constant, Linear, Smooth };

    Measure measure = Measure::ToLight;
    float begin = 0.0f, end = 1.0f;  ///< distances of the knots 0 and 1
    std::vector<float> knots;        ///< ascending; at least one
    std::vector<Rgb> colors;         ///< [knot]
    Interpolation interpolation = Interpolation::Linear;
};

/// A region in which receivers get other light.
struct RodFilter {
    RoundedBox box;
};

/// An opening in the plane z = 0 through which light falls.
struct BarnDoorFilter {
    FilterProjection projection;
    RoundedBox opening;
    /// How much the sides move per unit of the other coordinate: flaps that are turned.
    Vec2 slope_lower = Vec2(0.0f), slope_upper = Vec2(0.0f);
};

/// A texture in the plane z = 0 through which light falls, u along +x, v along +y, upright as the
/// light sees it along −z.
struct GoboFilter {
    enum class Outside : uint8_t { Fill, Clamp, Repeat };

    FilterProjection projection;
    float width = 1.0f, height = 1.0f;
    Vec2 uv_scale = Vec2(1.0f), uv_offset = Vec2(0.0f);  ///< of the texture, around its middle
    float rotation_deg = 0.0f;                           ///< of it, counterclockwise
    Outside outside = Outside::Fill;
    Rgb fill = Rgb(0.0f);
    std::string texture_file;  ///< resolved path
    TexelColors texture_colors;
};

using FilterShape =
    std::variant<IntensityFilter, RampFilter, RodFilter, BarnDoorFilter, GoboFilter>;

/// A UsdLux light filter, in the terms of none of the renderers that define some. It changes the
/// light that a receiver gets: by pattern × tint where it acts, the pattern being that of its
/// shape (a ramp's color, the lit share of an opening, a texel; else 1).
/// Ref: docs/reference/light_filters.md.
struct LightFilter {
    std::string name;          ///< prim path
    Mat4d parent_from_filter;  ///< parent: render space, or the space of a mesh light's shape
    Rgb tint = Rgb(1.0f);
    float saturation = 1.0f;
    float density = 1.0f;      ///< [0, 1], how much of it acts
    bool is_inverted = false;  ///< 1 − pattern, or the outside of a region
    FilterShape shape;
};

}  // namespace velatura::scene
