// SPDX-License-Identifier: MIT
// What the intensities around each pixel have to tell its distance by, for the confidence.

// The grid of pixels whose gradients are looked at.
#define STRUCTURE_RADIUS 3
#define STRUCTURE_STEP 2
// Largest variance that is taken for noise, of two grey levels: more may be fine texture.
#define LARGEST_NOISE 6e-5f

// Variance of the noise in the reference patch, of which second differences along every other one of its rows have six
// times as much.
FN float reference_noise(CONTEXT_ARGUMENT ivec2 pixel) {
  float differences = 0.0f;
  float sum = 0.0f;
  for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; dy += 2) {
    IntensityRow row = intensity_row(CONTEXT REFERENCE, ivec2(pixel.x - WINDOW_RADIUS, pixel.y + dy));
    float last = MASKED_INTENSITY;
    float last_but_one = MASKED_INTENSITY;
    for (int dx = 0; dx <= 2 * WINDOW_RADIUS; ++dx) {
      float a = intensity_in_row(row, dx);
      float difference = (a - last) - (last - last_but_one);
      bool usable = min(a, min(last, last_but_one)) >= 0.0f;
      differences += usable ? 1.0f : 0.0f;
      sum += usable ? difference * difference : 0.0f;
      last_but_one = last;
      last = a;
    }
  }
  return sum / (6.0f * max(differences, 1.0f));
}

// From the pixel's ray to that of the next pixel along `axis`, towards the image's middle; zero where that has none.
FN vec3 step_of_ray(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, ivec2 axis) {
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  ivec2 step = ivec2(2 * pixel.x < size.x ? axis.x : -axis.x, 2 * pixel.y < size.y ? axis.y : -axis.y);
  vec4 next = ray_at(CONTEXT REFERENCE, nearest_in_image(size, ivec2(pixel.x + step.x, pixel.y + step.y)));
  return next.w != 0.0f ? vec3(next.x, next.y, next.z) - ray : vec3(0.0f, 0.0f, 0.0f);
}

// How much narrower than high a pixel is, by the squares of the angles that it spans: 1 but for panoramas and wide lenses.
FN float squeeze_of(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray) {
  vec3 width = step_of_ray(CONTEXT pixel, ray, ivec2(1, 0));
  vec3 height = step_of_ray(CONTEXT pixel, ray, ivec2(0, 1));
  float width2 = dot(width, width);
  float height2 = dot(height, height);
  return width2 > 0.0f && height2 > 0.0f ? width2 / height2 : 1.0f;
}

// Stores the share of the squared gradients of intensity (per angle) that lies along the epipolar curve, the variance of
// the slopes there (per pixel of the reference), net of noise's, the variance of that noise, and 1 where this is known,
// else 0.
FN void structure_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 structure = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  if (is_usable(CONTEXT pixel, usable_ray) && held.w < INVALID_COST) {
    vec3 m = vec3(held.x, held.y, held.z);
    vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
    vec2 velocity;
    int source = agreeing_source(CONTEXT pixel, ray, m, velocity);
    vec2 direction = reference_direction(CONTEXT source, pixel, m, (1.0f / max(length(velocity), 1e-9f)) * velocity);
    float n = 0.0f;
    float sum = 0.0f;
    float along = 0.0f;
    // Of rows and of columns by themselves: Mesa adds terms of a sum one by one.
    vec2 all = vec2(0.0f, 0.0f);
    for (int dy = -STRUCTURE_RADIUS; dy <= STRUCTURE_RADIUS; dy += STRUCTURE_STEP) {
      for (int dx = -STRUCTURE_RADIUS; dx <= STRUCTURE_RADIUS; dx += STRUCTURE_STEP) {
        float intensity;
        vec2 gradient;
        if (!gradient_at(CONTEXT ivec2(pixel.x + dx, pixel.y + dy), intensity, gradient)) continue;
        float slope = dot(gradient, direction);
        n += 1.0f;
        sum += slope;
        along += slope * slope;
        all.x += gradient.x * gradient.x;
        all.y += gradient.y * gradient.y;
      }
    }
    float length2 = dot(direction, direction);
    // What is the same everywhere tells nothing.
    float samples = max(n, 1.0f);
    float variance = (along - sum * sum / samples) / max(samples * length2, 1e-12f);
    float noise = reference_noise(CONTEXT pixel);
    // Differences over two pixels have half the noise's variance, those of half pixels up to 0.8 times as much.
    float net = variance - 0.5f * min(noise, LARGEST_NOISE);
    float squeeze = squeeze_of(CONTEXT pixel, ray);
    float angle2 = squeeze * direction.x * direction.x + direction.y * direction.y;
    float share = along / max(angle2 * (all.x / squeeze + all.y), 1e-12f);
    // Not at an epipole, nor where the source does not see the point.
    structure = vec4(share, net, noise, n > 0.0f && length2 > 0.0f ? 1.0f : 0.0f);
  }
  store_prior(CONTEXT REFERENCE, pixel, structure);
}
