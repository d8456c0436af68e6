// SPDX-License-Identifier: Apache-2.0
// The program velatura-pictures: all decoders of OpenImageIO, away from the renderer.
#include "plugins/openimageio/apart/starter.h"
#include "plugins/openimageio/file_source.h"

#include <OpenImageIO/imageio.h>

int main() {
    using namespace velatura::plugins::openimageio;
    FileSource source;
    // Lists of formats are made once, for all readers
    (void)OIIO::ImageInput::create("png");
    OIIO::geterror();
    return run_starter(source);
}
