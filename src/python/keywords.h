// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_arguments.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::python {

/// A keyword argument of Python as words.
struct Keyword {
    std::string name;                 ///< as written: `target_error`
    std::vector<std::string> values;  ///< one, or those of a list
    bool is_list = false;
    std::optional<bool> truth = {};  ///< True or False
};

/// Options of `velatura render` by keyword: `target_error="1%"` is `--target-error=1%`, read and
/// checked by the command's own code. Lists are repeated options, options of several values (res,
/// crop) or values separated by commas; True and False are flags, or `on` and `off`.
/// Throws: Failure: Keyword (unknown name, with the nearest ones; an option that only the command
/// has), Usage (a wrong value).
app::RenderArguments render_arguments(const std::string& scene,
                                      const std::vector<Keyword>& keywords);

/// Names of all keywords, in the order of the command's help.
std::vector<std::string> render_keywords();

}  // namespace velatura::python
