// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace velatura::app {

/// A page of `velatura help TOPIC`.
struct HelpTopic {
    std::string_view name;
    std::string_view summary;
    std::string_view text;  ///< whole lines, at most 60 of at most 100 columns
};

std::span<const HelpTopic> help_topics();

}  // namespace velatura::app
