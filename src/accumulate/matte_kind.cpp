// SPDX-License-Identifier: Apache-2.0
#include "accumulate/matte_kind.h"

#include <algorithm>

namespace velatura::accumulate {

std::string_view matte_layer(MatteKind kind) {
    return kind == MatteKind::Object ? "CryptoObject" : "CryptoMaterial";
}

bool is_matte_layer(std::string_view name) {
    return std::any_of(matte_kinds.begin(), matte_kinds.end(),
                       [name](MatteKind kind) { return matte_layer(kind) == name; });
}

std::string_view matte_word(MatteKind kind) {
    return kind == MatteKind::Object ? "object" : "material";
}

}  // namespace velatura::accumulate
