// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/controls.h"

#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}

namespace velatura::compositor {

/// The look that a command line asks for.
struct LookOptions {
    std::string preset;
    std::vector<std::pair<Control::Kind, std::string>> controls;  ///< in the order typed
    float exposure = 0;

    void add_to(CLI::App& command);

    /// The preset with the controls after it. Errors: "bad-gain", "bad-preset", those of read_file.
    Result<Look> look() const;
};

}  // namespace velatura::compositor
