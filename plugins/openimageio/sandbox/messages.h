// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "plugins/openimageio/sandbox/image_source.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace velatura::plugins::openimageio {

/// Changes when a message does: the program and the plugin may be of different builds.
inline constexpr uint32_t protocol_version = 1;

enum class RequestKind : uint32_t { Open = 1, ReadLines, ReadTile, Close };

/// From the renderer to a decoder. What is long (the name of the asset, the answer) lies in the
/// area that both share.
struct Request {
    uint32_t version = protocol_version;
    RequestKind kind = RequestKind::Open;
    uint64_t serial = 0;      ///< the answer repeats it
    uint64_t image = 0;       ///< the renderer's number for it
    uint64_t area_bytes = 0;  ///< of the area, that may be used
    uint32_t name_bytes = 0;  ///< of Open
    ImageUse use = ImageUse::Image;
    int32_t level = 0, channels = 0;
    int32_t x = 0, y = 0, y_end = 0;
    int32_t unused = 0;
};

enum class ReplyStatus : uint32_t { Done = 1, Refused };

/// From a decoder to the renderer.
struct Reply {
    uint32_t version = protocol_version;
    ReplyStatus status = ReplyStatus::Done;
    uint64_t serial = 0;
    uint64_t bytes = 0;  ///< at the start of the area: a spec, values, or why it was refused
};

/// What comes back at most for Open, and as a reason.
inline constexpr size_t max_spec_bytes = size_t(64) << 10;
inline constexpr size_t max_reason_bytes = 1000;
/// Names of assets are not longer; see check_asset_name.
inline constexpr size_t max_name_bytes = size_t(16) << 10;

/// Values are best asked for in pieces of about so many bytes.
inline constexpr size_t piece_bytes = size_t(4) << 20;

/// How long an answer may be, in bytes.
struct PayloadSize {
    size_t min = 0, max = 0;
};

/// Length of what a reply leaves in the area; nothing of the area is looked at but the reason of a
/// rejection. Whatever the bytes are, the length lies within `size` and the area. Errors:
/// "reader-answer" (no answer to this request), "image-read" (refused; the decoder's reason).
Result<size_t> payload_length(const Request& request,
                              const PayloadSize& size,
                              std::string_view reply,
                              std::string_view area);

std::string spec_bytes(const SourceSpec& spec);

/// Any bytes are a spec or refused. Of a spec the levels are counted; their measures may be
/// anything. Errors: "reader-answer".
Result<SourceSpec> spec_of(std::string_view bytes);

/// On one line, without control characters and what is not UTF-8, no longer than
/// max_reason_bytes.
std::string plain_reason(std::string_view text);

}  // namespace velatura::plugins::openimageio
