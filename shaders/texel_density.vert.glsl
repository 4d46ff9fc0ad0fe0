// Surfaces with their places in lightmaps. In: position (object space), texel (place in the image, in texels), ratio
// (texels a meter over those asked for). Draws a little in front of what is there, so that it covers it.
void main()
{
  texel_at = texel;
  ratio_at = ratio;
  gl_Position = model_view_projection * vec4(position, 1.0);
  gl_Position.z -= 2e-5 * gl_Position.w;
}
