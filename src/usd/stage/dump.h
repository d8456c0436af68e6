// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/value.h"
#include "usd/stage/stage.h"

#include <string>

namespace velatura::usd::stage {

/// The composed facts of a stage, one per line: what `velatura info --dump` prints. Prims in
/// namespace order, inactive ones, overs, classes and instance proxies too; properties and metadata
/// sorted by name, fields of composition left out:
///
///     / meta KEY = VALUE
///     PRIM prim def|over|class "Type" defined=0|1 abstract=0|1 loaded=0|1 instance=0|1 model=0|1
///     PRIM prim INACTIVE def|over|class "Type"
///     PRIM children [a, b]
///     PRIM spec FILE.usda /Site              strongest first
///     PRIM api [A, B:c]
///     PRIM meta KEY = VALUE
///     PRIM variant SET = "selection"
///     PRIM.name attr [custom ][uniform ]TYPE
///     PRIM.name default = VALUE
///     PRIM.name novalue                      neither default nor samples
///     PRIM.name ts TIME = VALUE              200 at most, then "ts ... COUNT"
///     PRIM.name connect [<a>, <b>]
///     PRIM.name rel [custom ][<a>, <b>]
///     PRIM.name meta KEY = VALUE
///     COMPERR "message"                      of composition
///     ERR "message"                          further errors of the stage's diagnostics
std::string dump_stage(const Stage& stage);

/// One value as dumps have it. Arrays of more than 64 elements: their number, the 64-bit FNV-1a
/// hash of their text and the first ones.
std::string dump_value(const layer::Value& value);

}  // namespace velatura::usd::stage
