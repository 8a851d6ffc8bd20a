#pragma once

/// @file
/// The files of grapnel/scenario/schema, embedded by CMake.

namespace grapnel {

extern const char* const kStudySchemaText;
extern const char* const kOptimizationSchemaText;
extern const char* const kCampaignSchemaText;

}  // namespace grapnel
