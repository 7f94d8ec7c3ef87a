// The shading frame: unit normal, tangent and bitangent, perpendicular to each other. n points to the side that is shaded.
// In the comments of all models l and v are the unit directions to the light and the viewer, and h = (l + v)/|l + v|.
struct Frame {
    vec3 n;
    vec3 t;
    vec3 b;
};
