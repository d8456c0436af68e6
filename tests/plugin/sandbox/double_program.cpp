// SPDX-License-Identifier: Apache-2.0
// A program like velatura-decoder, with images of its own.
#include "double_images.h"
#include "plugins/openimageio/sandbox/fork_server.h"

int main() {
    velatura::plugins::openimageio::testing::DoubleImages images;
    return velatura::plugins::openimageio::run_fork_server(images);
}
