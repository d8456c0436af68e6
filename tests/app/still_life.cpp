// SPDX-License-Identifier: Apache-2.0
#include "still_life.h"

namespace velatura::test {

std::string still_life() {
    return R"usda(#usda 1.0
(
    defaultPrim = "W"
    upAxis = "Y"
)
def Xform "W"
{
    def Camera "Cam"
    {
        float focalLength = 50
        float horizontalAperture = 20
        float verticalAperture = 20
        float2 clippingRange = (0.01, 1000)
        double3 xformOp:translate = (0, 0, 10)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DomeLight "sky"
    {
        float inputs:intensity = 1
    }
    def Material "Paint"
    {
        token outputs:surface.connect = </W/Paint/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            token outputs:surface
        }
    }
    def Material "Veil"
    {
        token outputs:surface.connect = </W/Veil/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            float inputs:opacity = 0.25
            token inputs:opacityMode = "presence"
            token outputs:surface
        }
    }
    def Material "Glass"
    {
        token outputs:surface.connect = </W/Glass/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            float inputs:opacity = 0
            float inputs:roughness = 0
            token outputs:surface
        }
    }
    def Mesh "Square" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        rel material:binding = </W/Paint>
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1.5, -0.25, 0), (-0.25, -0.25, 0), (-0.25, 1, 0), (-1.5, 1, 0)]
        uniform token subdivisionScheme = "none"
    }
    def Mesh "Veil_1" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        rel material:binding = </W/Veil>
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1.5, -0.9, 2), (-0.2, -0.9, 2), (-0.2, 0.3, 2), (-1.5, 0.3, 2)]
        uniform token subdivisionScheme = "none"
    }
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        rel material:binding = </W/Glass>
        double radius = 0.5
        double3 xformOp:translate = (0.9, 0.9, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Xform "Proto"
    {
        def Cube "Body" (prepend apiSchemas = ["MaterialBindingAPI"])
        {
            rel material:binding = </W/Paint>
            double size = 0.5
        }
        def Cube "Head"
        {
            double size = 0.3
            double3 xformOp:translate = (0, 0.35, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        double3 xformOp:translate = (0.2, -1.2, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Xform "First" (
        instanceable = true
        prepend references = </W/Proto>
    )
    {
        double3 xformOp:translate = (0.9, -1.2, 0.3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Xform "Second" (
        instanceable = true
        prepend references = </W/Proto>
    )
    {
        double3 xformOp:translate = (1.3, -1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
)usda";
}

}  // namespace velatura::test
