// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "base/source_loc.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace velatura::usd::materialx {

/// An element of an XML file; text between elements is left out, MaterialX has none.
struct XmlElement {
    std::string name;
    std::vector<std::pair<std::string, std::string>> attributes;
    std::vector<XmlElement> children;
    SourceLoc loc;  ///< of its start

    /// Value of an attribute; empty when there is none.
    std::string_view attribute(std::string_view attribute_name) const;
};

/// What no file of materials needs, and files that mean harm do.
struct XmlLimits {
    size_t bytes = size_t(64) << 20;
    size_t elements = 1u << 20;
    size_t depth = 64;
};

/// The root element of an XML file. Document type declarations are refused, and with them all
/// entities but the five of XML itself: nothing expands. Where it fails, one error with the place
/// goes into `diagnostics`. Errors: "mtlx-xml".
Result<XmlElement> read_xml(std::string_view bytes,
                            const std::string& file,
                            Diagnostics& diagnostics,
                            const XmlLimits& limits = {});

}  // namespace velatura::usd::materialx
