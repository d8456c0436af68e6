// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/ies_profile.h"

#include <string_view>

namespace velatura::translate::lights {

/// Reads the text of an IES file: ANSI/IES LM-63 of 1986 to 2002, type C photometry. Symmetric
/// tables (a quadrant, one half, the half from 90° to 270°) are completed. Errors, with the line:
/// "ies-syntax" for what is no such file or contradicts itself, "ies-unsupported" for photometry of
/// types A and B.
Result<scene::IesProfile> parse_ies(std::string_view text);

}  // namespace velatura::translate::lights
