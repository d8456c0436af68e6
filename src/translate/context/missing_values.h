// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"

#include <initializer_list>
#include <string>

namespace velatura::translate {
inline namespace context {

/// Why an array that a prim needs holds nothing at a time: "points is not authored"; empty when it
/// holds something.
std::string missing_array(const Attribute& attribute, TimeCode time);

/// Whether one of the arrays that a prim cannot be rendered without holds nothing at ctx.time. One
/// warning says why, but for arrays that are authored empty: there is nothing to render then.
bool lacks_array(Context& ctx,
                 Prim prim,
                 std::initializer_list<const char*> names,
                 const char* code);

}  // namespace context
}  // namespace velatura::translate
