// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "study/compare.h"

#include <string>

namespace velatura::fuzz {

/// Any bytes up to a 0 and any after it are reports of studies, which are compared, or refused.
void report(std::string_view bytes) {
    const size_t end = bytes.find('\0');
    const std::string first(bytes.substr(0, end));
    const std::string second =
        end == std::string_view::npos ? first : std::string(bytes.substr(end + 1));
    (void)study::compare_reports(first, second).has_value();
}

}  // namespace velatura::fuzz
