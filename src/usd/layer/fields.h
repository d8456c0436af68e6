// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/token.h"

namespace velatura::usd::layer {

/// Names of the fields of specs. Ref: AOUSD Core Specification 1.0.1, 7.6 (core metadata fields).
struct FieldNames {
    // Layer (pseudo-root)
    Token default_prim{"defaultPrim"};
    Token sub_layers{"subLayers"};               ///< string array
    Token sub_layer_offsets{"subLayerOffsets"};  ///< std::vector<LayerOffset>, as long as subLayers
    Token layer_relocates{"layerRelocates"};     ///< Relocates
    Token expression_variables{"expressionVariables"};
    Token time_codes_per_second{"timeCodesPerSecond"};
    Token frames_per_second{"framesPerSecond"};
    Token start_time_code{"startTimeCode"};
    Token end_time_code{"endTimeCode"};
    Token up_axis{"upAxis"};
    Token meters_per_unit{"metersPerUnit"};
    // Prims
    Token specifier{"specifier"};  ///< Specifier
    Token type_name{"typeName"};   ///< token; of attributes too
    Token active{"active"};
    Token hidden{"hidden"};
    Token kind{"kind"};
    Token instanceable{"instanceable"};
    Token prim_order{"primOrder"};                ///< token array
    Token property_order{"propertyOrder"};        ///< token array
    Token references{"references"};               ///< ReferenceListOp
    Token payload{"payload"};                     ///< PayloadListOp
    Token inherit_paths{"inheritPaths"};          ///< PathListOp
    Token specializes{"specializes"};             ///< PathListOp
    Token variant_set_names{"variantSetNames"};   ///< StringListOp
    Token variant_selection{"variantSelection"};  ///< VariantSelections
    Token relocates{"relocates"};                 ///< Relocates
    Token api_schemas{"apiSchemas"};              ///< TokenListOp
    Token clips{"clips"};
    Token clip_sets{"clipSets"};
    Token custom_data{"customData"};
    Token permission{"permission"};
    Token documentation{"documentation"};
    Token comment{"comment"};
    // Properties
    Token custom{"custom"};
    Token variability{"variability"};  ///< Variability
    Token default_value{"default"};
    Token time_samples{"timeSamples"};          ///< TimeSamples
    Token spline{"spline"};                     ///< SplineValue
    Token connection_paths{"connectionPaths"};  ///< PathListOp
    Token target_paths{"targetPaths"};          ///< PathListOp
    Token interpolation{"interpolation"};
    Token element_size{"elementSize"};
    Token color_space{"colorSpace"};
};

/// The one table of interned names.
const FieldNames& fields();

}  // namespace velatura::usd::layer
