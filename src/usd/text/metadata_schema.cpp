// SPDX-License-Identifier: Apache-2.0
#include "usd/text/metadata_schema.h"

#include <string>
#include <unordered_map>

namespace velatura::usd::text {

namespace {

struct Entry {
    const char* key;
    const char* type;
};

constexpr Entry entries[] = {
    // Layers
    {"colorConfiguration", "asset"},
    {"colorManagementSystem", "token"},
    {"customLayerData", "dictionary"},
    {"defaultPrim", "token"},
    {"endFrame", "double"},
    {"endTimeCode", "double"},
    {"expressionVariables", "dictionary"},
    {"fallbackPrimTypes", "dictionary"},
    {"framePrecision", "int"},
    {"framesPerSecond", "double"},
    {"hasOwnedSubLayers", "bool"},
    {"kilogramsPerUnit", "double"},
    {"metersPerUnit", "double"},
    {"owner", "string"},
    {"renderSettingsPrimPath", "string"},
    {"sessionOwner", "string"},
    {"startFrame", "double"},
    {"startTimeCode", "double"},
    {"timeCodesPerSecond", "double"},
    {"upAxis", "token"},
    // Prims
    {"active", "bool"},
    {"apiSchemas", "tokenListOp"},
    {"assetInfo", "dictionary"},
    {"clips", "dictionary"},
    {"clipSets", "stringListOp"},
    {"customData", "dictionary"},
    {"displayGroupOrder", "string[]"},
    {"displayName", "string"},
    {"hidden", "bool"},
    {"inactiveIds", "int64ListOp"},
    {"instanceable", "bool"},
    {"kind", "token"},
    {"prefix", "string"},
    {"sdrMetadata", "dictionary"},
    {"suffix", "string"},
    {"symmetricPeer", "string"},
    {"symmetryArguments", "dictionary"},
    {"uiHints", "dictionary"},
    // Properties
    {"allowedTokens", "token[]"},
    {"arraySizeConstraint", "int64"},
    {"bindMaterialAs", "token"},
    {"colorSpace", "token"},
    {"connectability", "token"},
    {"constraintTargetIdentifier", "token"},
    {"displayGroup", "string"},
    {"elementSize", "int"},
    {"interpolation", "token"},
    {"limits", "dictionary"},
    {"noLoadHint", "bool"},
    {"outputName", "token"},
    {"renderType", "token"},
    {"unauthoredValuesIndex", "int"},
    {"weight", "float"},
    // List edits declared by Sdf's own tests
    {"intListOpTest", "intListOp"},
    {"int64ListOpTest", "int64ListOp"},
    {"uintListOpTest", "uintListOp"},
    {"uint64ListOpTest", "uint64ListOp"},
    {"stringListOpTest", "stringListOp"},
    {"tokenListOpTest", "tokenListOp"},
};

MetadataType type_of(std::string_view name) {
    if (name == "dictionary") return {MetadataKind::Dictionary};
    if (name == "tokenListOp") return {MetadataKind::TokenList};
    if (name == "stringListOp") return {MetadataKind::StringList};
    if (name == "intListOp") return {MetadataKind::IntList};
    if (name == "int64ListOp") return {MetadataKind::Int64List};
    if (name == "uintListOp") return {MetadataKind::UIntList};
    if (name == "uint64ListOp") return {MetadataKind::UInt64List};
    return {MetadataKind::Typed, layer::find_type(name)};
}

}  // namespace

MetadataType metadata_type(std::string_view key) {
    static const auto* const table = [] {
        auto* t = new std::unordered_map<std::string_view, MetadataType>;
        for (const Entry& e : entries) t->emplace(e.key, type_of(e.type));
        return t;
    }();
    const auto it = table->find(key);
    return it == table->end() ? MetadataType{} : it->second;
}

}  // namespace velatura::usd::text
