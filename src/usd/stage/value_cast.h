// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::usd::stage {

/// A value as T: exact type, else the same shape with other numbers (half, float, double,
/// integers), or other text (string, token, asset); arrays element-wise. nullopt when the shape
/// differs. Defined for the types below.
template <class T>
std::optional<T> value_cast(const layer::Value& value);

// Invokes X for every T of value_cast<T> and value_cast<std::vector<T>>
#define VELATURA_CAST_TYPES(X) \
    X(bool)                    \
    X(int)                     \
    X(int64_t)                 \
    X(float)                   \
    X(double)                  \
    X(std::string)             \
    X(layer::Token)            \
    X(layer::AssetPath)        \
    X(layer::Vec2f)            \
    X(layer::Vec3f)            \
    X(layer::Vec4f)            \
    X(layer::Vec2d)            \
    X(layer::Vec3d)            \
    X(layer::Vec4d)            \
    X(layer::Vec2i)            \
    X(layer::Vec3i)            \
    X(layer::Vec4i)            \
    X(layer::QuatFloat)        \
    X(layer::QuatDouble)       \
    X(layer::Mat2d)            \
    X(layer::Mat3d)            \
    X(layer::Mat4d)

/// True for types whose values are interpolated linearly (or by slerp) between samples.
bool is_interpolable(const layer::Value& value);

/// Value at u in [0, 1] between a (u = 0) and b: linear, slerp for quaternions, arrays element by
/// element when their lengths match; else a (held). Blocks hold too.
layer::Value interpolate(const layer::Value& a, const layer::Value& b, double u);

/// Retimes values of type timecode (scalars, arrays, in dictionaries) by a layer offset; others
/// come back unchanged.
layer::Value retime_value(const layer::Value& value, const layer::LayerOffset& to_stage);

}  // namespace velatura::usd::stage
