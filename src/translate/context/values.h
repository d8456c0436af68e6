// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "usd/stage/stage.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::translate {
inline namespace context {

/// Numbers of any numeric scalar, vector, quaternion or array value as rows of `width`; false for
/// other types. Quaternions give (x, y, z, w).
bool read_rows(const usd::layer::Value& value, std::vector<float>& rows, int& width);
bool read_rows(const usd::layer::Value& value, std::vector<double>& rows, int& width);

/// One number; `otherwise` when the attribute has no value or another type.
double read_number(const usd::stage::Attribute& attribute,
                   double otherwise,
                   usd::stage::TimeCode time);
int read_int(const usd::stage::Attribute& attribute, int otherwise, usd::stage::TimeCode time);
bool read_bool(const usd::stage::Attribute& attribute, bool otherwise, usd::stage::TimeCode time);
/// Vector of `width` numbers; nullopt when the attribute has no such value.
std::optional<std::vector<double>> read_vector(const usd::stage::Attribute& attribute,
                                               int width,
                                               usd::stage::TimeCode time);
/// Text of a string, token or asset value.
std::string read_text(const usd::stage::Attribute& attribute,
                      std::string_view otherwise,
                      usd::stage::TimeCode time);
/// Texts of a token[] or string[] value.
std::vector<std::string> read_texts(const usd::stage::Attribute& attribute,
                                    usd::stage::TimeCode time);
/// Elements of an integer array; empty when there is none.
std::vector<int64_t> read_ints(const usd::layer::Value& value);

using velatura::is_finite;
using velatura::to_float;
bool is_finite(const Vec3d& v);
/// Whether the matrix leaves at least two dimensions: the image of a surface is then a surface.
bool keeps_a_surface(const Mat4d& m);
/// Nearest float matrix.
Mat4 to_float(const Mat4d& m);

}  // namespace context
}  // namespace velatura::translate
