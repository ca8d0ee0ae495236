// SPDX-License-Identifier: MIT
// The list of kernels, from which their enumeration, names and entry points in every back end are made: whoever includes
// it, or reads it (cmake/shaders.cmake), makes something of each KERNEL(name, view). A kernel runs name_pixel() of
// algorithm.glsl for the pixels of that view: REFERENCE or OTHER (portable.h).
KERNEL(initialise, REFERENCE)       // random planes of a view and their cost
KERNEL(iterate, REFERENCE)          // one colour: candidates of the neighbours, then random refinements
KERNEL(transfer_clear, REFERENCE)   // empties the transfer buffers of a view
KERNEL(transfer_nearest, OTHER)     // forward-warps another view's planes: nearest inverse distance per pixel
KERNEL(transfer_winner, OTHER)      // ... smallest pixel index among the nearest ones
KERNEL(transfer_gather, REFERENCE)  // ... takes over the winner's plane, or a random one where there is none
KERNEL(check, REFERENCE)            // consistency, reasons and confidence of a view
KERNEL(downsample, REFERENCE)       // intensities of a view from those one level finer
KERNEL(sweep, REFERENCE)            // fronto-spherical planes over the whole range of inverse distances
KERNEL(upsample, REFERENCE)         // planes of a view from those one level coarser
KERNEL(search, REFERENCE)           // one colour: candidates of eight strips, then refinement in source pixels
KERNEL(measure, REFERENCE)          // how precisely each pixel is matched (kept where the checks go)
KERNEL(regress, REFERENCE)          // precision-weighted plane of each pixel's neighbourhood
KERNEL(adopt, REFERENCE)            // takes those planes over
KERNEL(fill, REFERENCE)             // planes of accepted pixels for the rejected ones around them
KERNEL(adopt_fill, REFERENCE)       // takes those planes over and marks the pixels
KERNEL(vote, REFERENCE)             // planes which most of the planes around agree with
KERNEL(vote_normal, REFERENCE)      // normals which most of the planes around agree with
KERNEL(transfer_keep, REFERENCE)    // keeps a view's own planes, moved on from the previous frame
KERNEL(renew, REFERENCE)            // starts a view from those
KERNEL(interpolate, REFERENCE)      // texels that samples of a view are filtered from: its pixels or half pixels
KERNEL(subpixel, REFERENCE)         // moves what was measured to where each patch matches best
KERNEL(ambiguity, REFERENCE)        // adds to the checks where another place matches better
KERNEL(adopt_point, REFERENCE)      // takes regressed planes over whose costs follow later
KERNEL(renew_point, REFERENCE)      // starts a view from moved planes whose costs follow later
KERNEL(check_for_vote, REFERENCE)   // consistency and reasons, and what the other view shows
KERNEL(structure, REFERENCE)        // what the intensities around tell distances by (kept where the priors go)
KERNEL(merge, REFERENCE)            // averages over the planes of all views
#undef KERNEL
