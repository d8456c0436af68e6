// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace velatura::python {

class Frame;

/// A Diagnostic with its file name.
struct Message {
    std::string severity;  ///< "note", "warning" or "error"
    std::string code;
    std::string file;               ///< empty: not known
    uint32_t line = 0, column = 0;  ///< 0: not known
    std::string prim;
    std::string message;
    std::string text;  ///< as the commands print it
};

std::vector<Message> messages_of(const Diagnostics& diagnostics);

/// What becomes a Python exception: thrown by this tier alone, and caught by the module.
class Failure : public std::runtime_error {
  public:
    /// Which exception: velatura.Error, velatura.UsageError, TypeError, velatura.Canceled.
    enum class Kind : uint8_t { Error, Usage, Keyword, Canceled };

    Failure(Kind of, std::string error_code, const std::string& text)
        : std::runtime_error(text), kind(of), code(std::move(error_code)) {}

    Kind kind;
    std::string code;
    std::vector<Message> messages = {};      ///< errors and warnings before it
    std::shared_ptr<Frame> frame = nullptr;  ///< of Canceled: what there is of the image, if any
};

/// Of the errors in `diagnostics`, the one that ended the work, with its file:line:column; `why`
/// where there is none.
Failure failure_of(const Diagnostics& diagnostics, const std::string& code, const std::string& why);

}  // namespace velatura::python
