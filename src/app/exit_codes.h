// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura::app {

/// Exit codes of every command; the table of docs/rendering.md.
enum ExitCode : int {
    Done = 0,
    RenderError = 1,  ///< scene, input/output or render error
    UsageError = 2,
    BudgetReached = 3,  ///< stopped before the target was reached; the file is valid
    CheckFailed = 4,    ///< numeric or closure check failed
    Refused = 5,        ///< the file is no part of this render, or another process renders to it
    MemoryReached = 6,  ///< the memory limit does not allow it; nothing was written
    SignalBase = 128,   ///< 128 + n after signal n
};

}  // namespace velatura::app
