// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>
#include <vector>

namespace velatura::view {

/// Opinions over a prim.
struct PrimEdit {
    std::string path;
    std::string type;                ///< of a prim that the scene does not have; empty: an `over`
    std::vector<std::string> lines;  ///< statements of .usda
};

/// A USD layer (.usda) of opinions over prims, each of which is named once.
std::string edits_layer(const std::vector<PrimEdit>& edits);

/// Writes it. Errors: "bad-output" (not .usda), those of write_file_atomically.
Result<void> save_edits(const std::string& path, const std::vector<PrimEdit>& edits);

}  // namespace velatura::view
