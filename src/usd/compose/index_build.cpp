// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/index_build.h"

#include "usd/compose/composer.h"

#include <utility>

namespace velatura::usd::compose {

void IndexBuild::report(
    ErrorKind kind, int i, SourceLoc loc, std::string message, const char* code) {
    composer.errors().add(
        {kind, stage_path, graph[i].stack->identifier(), graph[i].path, std::move(message), loc},
        code);
}

void IndexBuild::report_all(std::vector<CompositionError>& errors, int i) {
    for (CompositionError& error : errors) {
        error.prim = stage_path;
        error.layer_stack = graph[i].stack->identifier();
        composer.errors().add(std::move(error));
    }
    errors.clear();
}

void IndexBuild::note_payloads(bool has, bool included) {
    index.has_payloads_ = index.has_payloads_ || has;
    index.payloads_included_ = index.payloads_included_ || included;
}

void IndexBuild::forget_payloads() {
    index.has_payloads_ = false;
    index.payloads_included_ = false;
}

}  // namespace velatura::usd::compose
