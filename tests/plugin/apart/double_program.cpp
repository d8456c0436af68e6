// SPDX-License-Identifier: Apache-2.0
// A program like velatura-pictures, with pictures of its own.
#include "double_pictures.h"
#include "plugins/openimageio/apart/starter.h"

int main() {
    velatura::plugins::openimageio::testing::DoublePictures pictures;
    return velatura::plugins::openimageio::run_starter(pictures);
}
