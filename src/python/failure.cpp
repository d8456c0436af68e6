// SPDX-License-Identifier: Apache-2.0
#include "python/failure.h"

namespace velatura::python {

std::vector<Message> messages_of(const Diagnostics& diagnostics) {
    static constexpr const char* severities[] = {"note", "warning", "error"};
    std::vector<Message> messages;
    for (const Diagnostic& d : diagnostics.all())
        messages.push_back({severities[size_t(d.severity)], d.code,
                            diagnostics.file_name(d.loc.file_id), d.loc.line, d.loc.column,
                            d.prim_path, d.message, diagnostics.format(d)});
    return messages;
}

Failure failure_of(const Diagnostics& diagnostics,
                   const std::string& code,
                   const std::string& why) {
    std::vector<Message> messages = messages_of(diagnostics);
    std::string last_code = code, text = why;
    if (why.empty()) {
        for (const Message& m : messages) {
            if (m.severity != "error") continue;
            last_code = m.code;
            text = m.text;
        }
        if (text.empty()) text = "the render failed";
    } else {
        // The place of a file that cannot be read is in the diagnostics
        for (const Message& m : messages)
            if (m.severity == "error") text += "\n" + m.text;
    }
    Failure failure(Failure::Kind::Error, last_code, text);
    failure.messages = std::move(messages);
    return failure;
}

}  // namespace velatura::python
