// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/asset_bytes.h"
#include "base/diagnostics.h"
#include "base/result.h"
#include "usd/layer/layer.h"

#include <memory>
#include <string>

namespace velatura::usd::materialx {

/// The layer that a MaterialX document (.mtlx) stands for. What it is, OpenUSD's usdMtlx decides:
/// a surfacematerial is the Material </MaterialX/Materials/NAME> with the inputs of its surface
/// shader and `outputs:mtlx:surface`; below it stand the shader and, by reference, the node graphs
/// that it reads; those themselves, and nodes of the document, below </MaterialX/NodeGraphs>.
/// `info:id` is the name of the node definition ("ND_image_color3"). Nodes whose definition and
/// graph stand in the document become copies of the graph. The default prim is MaterialX.
/// Elements that have no place in it cost a warning. Errors: "mtlx-xml", "mtlx-document".
/// Ref: MaterialX Specification 1.38, 1.39; OpenUSD 25.05, pxr/usd/usdMtlx.
Result<std::shared_ptr<layer::Layer>> read_materialx_layer(const AssetBytesPtr& bytes,
                                                           const std::string& identifier,
                                                           Diagnostics& diagnostics);

}  // namespace velatura::usd::materialx
