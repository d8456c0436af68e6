// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/pictures_of_process.h"
#include "plugins/openimageio/sandbox/decoder_pool.h"

#include <dlfcn.h>

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

DecoderPool& pool_of_process() {
    // Never destroyed: threads may read until the process ends, and the other processes see that
    static DecoderPool& pool = *new DecoderPool({.program = program_of_plugin()});
    return pool;
}

}  // namespace

PictureSource& pictures_of_process() {
    return pool_of_process();
}

void limit_pictures_of_process(const DecodeLimits& limits) {
    constexpr double clock_per_cpu = 10;  // for disks that are slow, and machines that are busy
    pool_of_process().limit({.cpu_seconds = limits.seconds,
                             .wall_seconds = clock_per_cpu * limits.seconds,
                             .address_bytes = limits.bytes});
}

}  // namespace velatura::plugins::openimageio
