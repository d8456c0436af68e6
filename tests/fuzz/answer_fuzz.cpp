// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "plugins/openimageio/sandbox/messages.h"

#include <cstdlib>

namespace velatura::fuzz {

namespace images = plugins::openimageio;

/// Any bytes are what a process that reads images answers: a reply, and what lies in the area
/// that it shares. Its length lies within the area and what was asked for, and a spec that is read
/// is its own bytes again.
void answer(std::string_view bytes) {
    constexpr images::PayloadSize whole = {0, images::max_spec_bytes};
    const std::string_view reply = bytes.substr(0, sizeof(images::Reply));
    const std::string_view area = bytes.substr(reply.size());
    const images::Request request = {.serial = 1};
    const auto length = images::payload_length(request, whole, reply, area);
    if (!length) {
        if (length.error().message.size() > images::max_reason_bytes) std::abort();
        return;
    }
    if (*length > area.size() || *length > whole.max) std::abort();
    const std::string_view said = area.substr(0, *length);
    const auto spec = images::spec_of(said);
    if (spec && images::spec_bytes(*spec) != said) std::abort();
}

}  // namespace velatura::fuzz
