// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/file_source.h"
#include "plugins/openimageio/pictures_of_process.h"

namespace velatura::plugins::openimageio {

PictureSource& pictures_of_process() {
    static FileSource source;
    return source;
}

void limit_pictures_of_process(const DecodeLimits&) {}

}  // namespace velatura::plugins::openimageio
