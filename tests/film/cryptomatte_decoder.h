// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace velatura::test {

/// Reads a Cryptomatte by Psyop's specification alone, and shares nothing with
/// src/layers/cryptomatte.cpp: its own hash, its own reading of the manifest. A test fails where
/// the file is not as the specification says.
class CryptomatteDecoder {
  public:
    CryptomatteDecoder(const image::Image& image, const std::string& layer);

    /// What the pixels store for a name.
    static uint32_t id_of(const std::string& name);

    /// Coverage by the name: [height][width].
    std::vector<float> matte(const std::string& name) const { return of_id(id_of(name)); }

    std::vector<float> of_id(uint32_t id) const;
    /// Coverage by whatever there is.
    std::vector<float> total() const;

    std::map<std::string, uint32_t> manifest;
    /// Coverage by id, per pixel.
    std::vector<std::map<uint32_t, float>> pixels;
};

}  // namespace velatura::test
