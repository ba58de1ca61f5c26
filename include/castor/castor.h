/// Includes all public headers of Castor.
#pragma once

#include "castor/api.h"
#include "castor/built_scene.h"
#include "castor/device.h"
#include "castor/error.h"
#include "castor/film.h"
#include "castor/image_io.h"
#include "castor/progress.h"
#include "castor/renderer.h"
#include "castor/scene.h"
#include "castor/scene_io.h"
#include "castor/tracer.h"
#include "castor/tree_quality.h"
