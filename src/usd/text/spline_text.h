// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/spline.h"
#include "usd/text/scanner.h"
#include "usd/text/value_parser.h"

#include <string>

namespace velatura::usd::text {

/// Reads "{ bezier, 1: 2; post curve (3, 4), … }". `out.type` must be set, as the text does not
/// tell. Ref: AOUSD Core Specification 1.0.1, 16.2.13; tangent algorithms from OpenUSD.
bool parse_spline(Scanner& scanner, ValueParser& values, layer::SplineValue& out);

/// Writes the lines between the braces, each ended by ",\n", in the layout of OpenUSD. `dictionary`
/// appends a dictionary in one line.
template <class AppendDictionary>
void append_spline(std::string& out,
                   const layer::SplineValue& spline,
                   int indent,
                   const AppendDictionary& dictionary);

/// One knot without its custom data: "1: 2; post held".
void append_knot(std::string& out, const layer::SplineValue& spline, size_t i);
/// Curve, extrapolations and loop, one per line.
void append_spline_head(std::string& out, const layer::SplineValue& spline, int indent);

template <class AppendDictionary>
void append_spline(std::string& out,
                   const layer::SplineValue& spline,
                   int indent,
                   const AppendDictionary& dictionary) {
    append_spline_head(out, spline, indent);
    for (size_t i = 0; i < spline.knots.size(); ++i) {
        out.append(size_t(indent) * 4, ' ');
        append_knot(out, spline, i);
        if (!spline.knots[i].custom_data.empty()) {
            out += "; ";
            dictionary(spline.knots[i].custom_data);
        }
        out += ",\n";
    }
}

}  // namespace velatura::usd::text
