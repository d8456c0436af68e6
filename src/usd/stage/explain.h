// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/stage/stage.h"

#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::stage {

/// One layer's say on something.
struct ExplainedOpinion {
    std::string what;   ///< "default", "time samples", "clips \"walk\"", "spec", "fallback", …
    std::string arc;    ///< way from the prim to the site, "local" or "reference > variant"
    std::string layer;  ///< identifier of the layer; empty for schema fallbacks
    std::string site;   ///< path of the spec inside the layer
    SourceLoc loc;
    std::string value;  ///< shortened
    bool decides = false;
    std::string note;  ///< why it does not count, or what it blocks; may be empty
};

/// Why an object is what it is: all opinions, strongest first.
struct Explanation {
    std::string subject;  ///< "/World/Cube.size double"
    std::string result;   ///< composed value, shortened
    std::string reason;   ///< which opinion wins and why
    std::vector<ExplainedOpinion> opinions;
};

/// Explains "/Prim", "/Prim.attribute" (at a time), "/Prim.relationship", or a metadatum of one of
/// these: "/Prim#kind", "/Prim.attr#interpolation", "/#upAxis".
/// Errors: `unknown-object` when the prim or property does not exist.
Result<Explanation> explain(const Stage& stage, std::string_view object, TimeCode time = {});

/// The explanation as lines of text, with file:line:column for every opinion.
std::string explanation_text(const Explanation& explanation, const Diagnostics& diagnostics);

}  // namespace velatura::usd::stage
