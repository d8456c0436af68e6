// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/sandbox/image_source.h"

#include <cstddef>
#include <string>
#include <vector>

namespace velatura::plugins::openimageio::testing {

/// Images whose values are known without a file, for a program that does to itself what broken
/// decoders do. The asset's name is `what[:when][/anything]`, or `[folder/]what.png` as scenes have
/// it; `when` is "open" or "read" (else).
/// - plain: is what it says.
/// - segv, kill, abort, exit: the process ends so.
/// - stop, spin, memory: it is stopped, computes for ever, takes all memory.
/// - busy: computes for 0.2 s.
/// - throw: an exception.
/// - poison: the next request for another image ends in a crash.
/// - liar: answers of another length are sent.
/// - other: the file is another one each time it is opened.
/// - write, remove, socket, fork, signal, limit: is tried, and ends the process where that is not
/// refused.
/// - thread: starts one.
class DoubleImages final : public ImageSource {
  public:
    static constexpr int width = 100, height = 3000, channels = 3, tile = 16;

    Result<std::unique_ptr<SourceImage>> open(const std::string& asset, ImageUse use) override;

    /// What an image of that name has there.
    static float value(const std::string& asset, int x, int y, int channel);
    /// Lines y … y_end-1.
    static std::vector<float> lines(const std::string& asset, int y, int y_end);
};

}  // namespace velatura::plugins::openimageio::testing
