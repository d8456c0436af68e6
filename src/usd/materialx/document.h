// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/materialx/xml.h"

#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::materialx {

/// A MaterialX document with what it includes: the elements below <materialx>, each of which now
/// carries what it inherits from there (`colorspace`, `fileprefix`).
struct Document {
    std::vector<XmlElement> elements;
    std::string file;
    bool is_before_139 = true;
};

/// Reads a document. xi:include is followed to files beside the including one; what cannot be
/// included costs one error, and reading goes on. Errors: "mtlx-xml", "mtlx-document".
Result<Document> read_document(std::string_view bytes,
                               const std::string& file,
                               Diagnostics& diagnostics);

}  // namespace velatura::usd::materialx
