// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/path.h"
#include "usd/layer/token.h"

#include <Imath/ImathMatrix.h>
#include <Imath/ImathQuat.h>
#include <Imath/ImathVec.h>
#include <Imath/half.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::usd::layer {

// Numeric value types of USD in C++. Matrices act on row vectors; quaternions are (r, v) = (w, x,
// y, z).
using Float16 = Imath::half;
using Vec2h = Imath::Vec2<Imath::half>;
using Vec3h = Imath::Vec3<Imath::half>;
using Vec4h = Imath::Vec4<Imath::half>;
using Vec2f = Imath::V2f;
using Vec3f = Imath::V3f;
using Vec4f = Imath::V4f;
using Vec2d = Imath::V2d;
using Vec3d = Imath::V3d;
using Vec4d = Imath::V4d;
using Vec2i = Imath::V2i;
using Vec3i = Imath::V3i;
using Vec4i = Imath::Vec4<int>;
using QuatHalf = Imath::Quat<Imath::half>;
using QuatFloat = Imath::Quatf;
using QuatDouble = Imath::Quatd;
using Mat2d = Imath::Matrix22<double>;
using Mat3d = Imath::M33d;
using Mat4d = Imath::M44d;

/// A value of type timecode: a time in the authoring layer's time codes, retimed by composition.
struct TimeCodeValue {
    double value = 0.0;
    bool operator==(const TimeCodeValue&) const = default;
};

/// A value of type asset, as authored: not anchored, not resolved; in backquotes it is a variable
/// expression.
struct AssetPath {
    std::string path;
    bool operator==(const AssetPath&) const = default;
};

/// A value of type pathExpression, kept as text.
struct PathExpression {
    std::string text;
    bool operator==(const PathExpression&) const = default;
};

/// The value of attributes of type opaque or group: there is none.
struct OpaqueValue {
    bool operator==(const OpaqueValue&) const = default;
};

/// Metadata of a name no schema declares, or a value of an unknown type: the text as it was
/// written.
struct UnregisteredValue {
    std::string text;
    bool operator==(const UnregisteredValue&) const = default;
};

enum class Specifier : uint8_t { Def, Over, Class };
enum class Permission : uint8_t { Public, Private };
enum class Variability : uint8_t { Varying, Uniform };

/// Maps a time of the target layer to the referring one: t' = offset + scale · t.
struct LayerOffset {
    double offset = 0.0;
    double scale = 1.0;

    bool operator==(const LayerOffset&) const = default;

    bool is_identity() const { return *this == LayerOffset{}; }

    double apply(double t) const { return offset + scale * t; }

    /// First `inner`, then this one.
    LayerOffset after(const LayerOffset& inner) const {
        return {offset + scale * inner.offset, scale * inner.scale};
    }

    /// Undoes this one; scale must not be 0.
    LayerOffset inverse() const { return {-offset / scale, 1.0 / scale}; }
};

/// Old prim path → new prim path, in authored order; an empty new path deletes.
using Relocates = std::vector<std::pair<Path, Path>>;

/// Variant set → selected variant, in authored order; an empty variant is a selection of none.
using VariantSelections = std::vector<std::pair<std::string, std::string>>;

}  // namespace velatura::usd::layer

template <>
struct std::hash<velatura::usd::layer::UnregisteredValue> {
    size_t operator()(const velatura::usd::layer::UnregisteredValue& v) const {
        return std::hash<std::string>()(v.text);
    }
};
