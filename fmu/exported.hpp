#pragma once

/// @file
/// What the library shows: the functions of the standards, and nothing else.

#define GRAPNEL_FMI_FUNCTION extern "C" __attribute__((visibility("default")))
