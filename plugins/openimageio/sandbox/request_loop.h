// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/file_descriptor.h"
#include "plugins/openimageio/sandbox/image_source.h"

namespace velatura::plugins::openimageio {

/// What a decoder ends with when it cannot have the memory that it asks for.
inline constexpr int out_of_memory_exit_code = 3;

/// The other process: answers the requests (messages.h) that come by `socket`, with images of
/// `source`, through the area that `area` is the file of, until the socket's other end is closed.
void answer_requests(ImageSource& source, const FileDescriptor& socket, FileDescriptor area);

}  // namespace velatura::plugins::openimageio
