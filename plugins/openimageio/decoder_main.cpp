// SPDX-License-Identifier: Apache-2.0
// The program velatura-decoder: all decoders of OpenImageIO, outside of the renderer.
#include "plugins/openimageio/file_source.h"
#include "plugins/openimageio/sandbox/fork_server.h"

#include <OpenImageIO/imageio.h>

int main() {
    using namespace velatura::plugins::openimageio;
    FileSource source;
    // Lists of formats are made once, for all decoders
    (void)OIIO::ImageInput::create("png");
    OIIO::geterror();
    return run_fork_server(source);
}
