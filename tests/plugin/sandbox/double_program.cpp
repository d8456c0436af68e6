// SPDX-License-Identifier: Apache-2.0
// A program like velatura-decoder, with pictures of its own.
#include "double_pictures.h"
#include "plugins/openimageio/sandbox/fork_server.h"

int main() {
    velatura::plugins::openimageio::testing::DoublePictures pictures;
    return velatura::plugins::openimageio::run_fork_server(pictures);
}
