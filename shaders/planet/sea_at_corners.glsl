// Where tiles.vert finds the sea's light: in glints it is as uneven as the waves, and places on two faces of the
// noise's cube leave no outputs for it.
#if defined(SEA_AT_CORNERS) && !defined(GLINT) && !defined(TWO_FACES)
#define SEA_IS_EVEN
#endif
