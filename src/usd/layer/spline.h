// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"

#include <cstdint>
#include <vector>

namespace velatura::usd::layer {

/// What the numbers of a spline are stored as. Ref: AOUSD Core Specification 1.0.1, 7.4.2.4.
enum class SplineType : uint8_t { Double, Float, Half };
enum class SplineCurve : uint8_t { Bezier, Hermite };
enum class SplineInterpolation : uint8_t { None, Held, Linear, Curve };
enum class SplineExtrapolationMode : uint8_t {
    None,
    Held,
    Linear,
    Sloped,
    LoopRepeat,
    LoopReset,
    LoopOscillate
};
/// How a tangent came about; from OpenUSD, beyond the standard. Its numbers hold in any case.
enum class SplineTangentAlgorithm : uint8_t { None, Custom, AutoEase };

struct SplineTangent {
    double width = 0.0;  ///< in time; unused in Hermite splines
    double slope = 0.0;  ///< value per time
    SplineTangentAlgorithm algorithm = SplineTangentAlgorithm::None;

    bool operator==(const SplineTangent&) const = default;
};

struct SplineKnot {
    double time = 0.0;
    double value = 0.0;      ///< from the knot on
    double pre_value = 0.0;  ///< up to the knot, where is_dual
    bool is_dual = false;
    SplineInterpolation next = SplineInterpolation::Held;  ///< of the segment after the knot
    SplineTangent pre;
    SplineTangent post;
    Dictionary custom_data;

    bool operator==(const SplineKnot&) const = default;
};

struct SplineExtrapolation {
    SplineExtrapolationMode mode = SplineExtrapolationMode::Held;
    double slope = 0.0;  ///< where Sloped

    bool operator==(const SplineExtrapolation&) const = default;
};

/// The part of a spline that is repeated before and after itself, down to nothing where all is 0.
struct SplineLoop {
    double start = 0.0;
    double end = 0.0;
    int32_t pre_count = 0;
    int32_t post_count = 0;
    double value_offset = 0.0;  ///< added per repetition

    bool operator==(const SplineLoop&) const = default;
};

/// An authored spline. Knots are in the order of the file, which need not be that of time.
struct SplineValue {
    SplineType type = SplineType::Double;
    SplineCurve curve = SplineCurve::Bezier;
    bool is_time_valued = false;  ///< values are times, so that offsets of layers act on them
    SplineExtrapolation pre;
    SplineExtrapolation post;
    SplineLoop loop;
    std::vector<SplineKnot> knots;

    bool operator==(const SplineValue&) const = default;
};

}  // namespace velatura::usd::layer
