// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/decoding.h"

#include "plugins/openimageio/in_process_source.h"
#include "plugins/openimageio/sandbox/decoder_pool.h"

#include <dlfcn.h>

#include <algorithm>
#include <atomic>
#include <filesystem>

namespace velatura::plugins::openimageio {

namespace {

/// Beside the shared object that holds this function.
std::string program_of_plugin() {
    Dl_info object = {};
    if (::dladdr(reinterpret_cast<const void*>(&program_of_plugin), &object) == 0 ||
        object.dli_fname == nullptr)
        return VELATURA_DECODER_PROGRAM;
    return (std::filesystem::path(object.dli_fname).parent_path() / VELATURA_DECODER_PROGRAM)
        .string();
}

// Neither is ever destroyed: threads may read until the process ends, and decoder processes see
// that

DecoderPool& decoder_pool() {
    static DecoderPool& pool = *new DecoderPool({.program = program_of_plugin()});
    return pool;
}

InProcessSource& in_process_source() {
    static InProcessSource& source = *new InProcessSource(decoder_pool());
    return source;
}

std::atomic<ImageSource*> selected = nullptr;

}  // namespace

ImageSource& select_image_source(const DecodeLimits& limits) {
    constexpr double clock_per_cpu = 10;  // for disks that are slow, and machines that are busy
    decoder_pool().limit({.cpu_seconds = limits.seconds,
                          .wall_seconds = clock_per_cpu * limits.seconds,
                          .address_bytes = limits.bytes});
    if (limits.is_sandboxed) {
        selected = &decoder_pool();
        return decoder_pool();
    }
    in_process_source().limit(std::min(limits.bytes, limits.in_process_bytes));
    selected = &in_process_source();
    return in_process_source();
}

ImageSource& image_source() {
    ImageSource* const source = selected;
    return source != nullptr ? *source : decoder_pool();
}

}  // namespace velatura::plugins::openimageio
