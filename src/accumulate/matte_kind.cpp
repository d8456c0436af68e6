// SPDX-License-Identifier: Apache-2.0
#include "accumulate/matte_kind.h"

#include <algorithm>

namespace velatura::accumulate {

namespace {

constexpr std::array<std::string_view, matte_kinds.size()> layers = {
    "CryptoObject", "CryptoMaterial", "CryptoAsset"};
constexpr std::array<std::string_view, matte_kinds.size()> words = {"object", "material", "asset"};

}  // namespace

std::string_view matte_layer(MatteKind kind) {
    return layers[size_t(kind)];
}

bool is_matte_layer(std::string_view name) {
    return std::any_of(matte_kinds.begin(), matte_kinds.end(),
                       [name](MatteKind kind) { return matte_layer(kind) == name; });
}

std::string_view matte_word(MatteKind kind) {
    return words[size_t(kind)];
}

}  // namespace velatura::accumulate
