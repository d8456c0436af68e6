// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura::plugins::openimageio {

/// Forbids this process, for good, what a decoder has no need of: sockets, programs, further
/// processes, signals to others, files that are written, removed or renamed, other limits. Threads,
/// memory and reading go on; what is forbidden fails with EPERM. Nothing happens on machines other
/// than x86-64 and 64-bit ARM, and where the system has no such filter. Needs PR_SET_NO_NEW_PRIVS.
void install_seccomp_filter();

}  // namespace velatura::plugins::openimageio
