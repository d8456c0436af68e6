// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::test {

class Workplace;

/// What the dynamic linker says that it opened while the program ran in the folder of `w`: one file
/// a line or more. The program must end well.
std::string opened_files(const Workplace& w,
                         const std::string& program,
                         const std::string& arguments);

/// Fails where something heavy was opened that a plain scene does not call for.
void expect_nothing_heavy(const std::string& opened, const std::string& what);

}  // namespace velatura::test
