// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>

namespace velatura::image {

/// Walks through the headers of an OpenEXR file: OpenEXR takes memory for as many bytes as an attribute says before it reads them,
/// and reads on where a value ended by its type, wherever that should have been. Files that are none are left to OpenEXR to refuse.
/// Errors: "io-open", with the file, where an attribute leads out of it or is of another size than its type.
Result<void> check_headers(const std::string& path);

}  // namespace velatura::image
