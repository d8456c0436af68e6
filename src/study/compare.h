// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>

namespace velatura::study {

/// What differs between two reports (JSON texts of to_json), as a table: error and time of the
/// render, and of every setting that both have what it is worth against the render as it is.
/// Differences within both intervals are marked as such. Errors: "study-json".
Result<std::string> compare_reports(const std::string& a, const std::string& b);

}  // namespace velatura::study
