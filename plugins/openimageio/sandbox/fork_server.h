// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/sandbox/image_source.h"

namespace velatura::plugins::openimageio {

/// The whole of a program that starts decoders, each a copy of this process that answers requests
/// with images of `source`, until the one that sends commands is gone; its decoders then are,
/// too. Must be called before anything of the program starts a thread of its own. Returns: the exit
/// code.
int run_fork_server(ImageSource& source);

}  // namespace velatura::plugins::openimageio
