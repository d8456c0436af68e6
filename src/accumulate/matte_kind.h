// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace velatura::accumulate {

/// What mattes can be cut by.
enum class MatteKind : uint8_t { Object, Material, Asset };

inline constexpr std::array matte_kinds = {MatteKind::Object, MatteKind::Material,
                                           MatteKind::Asset};

/// "CryptoObject", "CryptoMaterial", "CryptoAsset".
std::string_view matte_layer(MatteKind kind);

/// Whether it is one of them.
bool is_matte_layer(std::string_view name);

/// "object", "material", "asset".
std::string_view matte_word(MatteKind kind);

}  // namespace velatura::accumulate
