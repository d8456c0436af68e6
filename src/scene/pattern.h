// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/ids.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::scene {

/// Four numbers that pass between the steps of a pattern: a number stands in all four, of vectors
/// and colors those beyond the width mean nothing.
using PatternValue = Imath::V4f;

/// What a step of a pattern does. a, b, c, d are its inputs.
enum class PatternOp : uint8_t {
    // What is known of a surface point; Step::data says which
    Constant,   ///< Pattern::constants
    Texture,    ///< a texture at its own coordinates, RGBA
    TextureAt,  ///< a texture at a, its own coordinates left out; finest texels
    Primvar,    ///< a primvar, or a where the shape has none
    Position,   ///< data 0: in render space; 1: in shape space
    Normal,     ///< interpolated, unit, render space
    // Channel by channel
    Add,
    Subtract,
    Multiply,
    Divide,  ///< 0 where b is 0
    Modulo,  ///< a − b·⌊a / b⌋; 0 where b is 0
    Power,   ///< of |a|, with the sign of a
    Minimum,
    Maximum,
    Absolute,
    Sign,
    Floor,
    Ceiling,
    Round,  ///< halves away from 0
    SquareRoot,
    Exponential,
    Logarithm,
    Sine,
    Cosine,
    Tangent,
    ArcSine,
    ArcCosine,
    ArcTangent,  ///< of a / b, by the signs of both
    Mix,         ///< a + (b − a)·c
    Smoothstep,  ///< of a between b and c
    IfGreater,   ///< c where a.x > b.x, else d
    IfGreaterOrEqual,
    IfEqual,
    DecodeSrgb,  ///< transfer curve of IEC 61966-2-1 to linear
    // Across channels
    Dot,
    Cross,
    Swizzle,  ///< see swizzle_data
    Combine,  ///< (a.x, b.x, c.x, d.x)
    Rotate2,  ///< (a.x, a.y) clockwise by b degrees
    Rotate3,  ///< a about the axis c, clockwise by b degrees
    HsvFromRgb,
    RgbFromHsv,
    // Noise; data: 0 = one number, 1 = three of their own
    Noise2,
    Noise3,
    CellNoise2,
    CellNoise3,
    Fractal3,  ///< octaves of Noise3: a position, b octaves, c lacunarity, d diminish
};

struct PatternStep {
    PatternOp op = PatternOp::Constant;
    uint8_t width = 1;              ///< channels of the result; of Dot, those of the inputs
    uint16_t in[4] = {0, 0, 0, 0};  ///< earlier steps
    uint32_t data = 0;

    bool operator==(const PatternStep&) const = default;
};

/// A node graph that feeds one input, as a list of steps; the last one is the result.
struct Pattern {
    std::vector<PatternStep> steps;  ///< at most max_pattern_steps
    std::vector<PatternValue> constants;
};

inline constexpr size_t max_pattern_steps = 512;

/// Inputs that an operation reads.
int input_count(PatternOp op);

/// The step depends on nothing but its inputs.
inline bool is_pure(PatternOp op) {
    return op > PatternOp::Normal;
}

/// Channel `from` (0 to 3, or 4 = zero, 5 = one) for each channel of a Swizzle.
constexpr uint32_t swizzle_data(uint32_t x, uint32_t y, uint32_t z, uint32_t w) {
    return x | y << 3 | z << 6 | w << 9;
}

/// Result of a pure step. in: [input_count(step.op)]. Finite where the inputs are in the domain of
/// the operation; what is outside (the logarithm of 0) counts as 0.
/// Ref: MaterialX Specification 1.38, "Standard Pattern Nodes"; noise: pattern_noise.h.
PatternValue result_of(const PatternStep& step, const PatternValue* in);

}  // namespace velatura::scene
