// Loads a glTF file with baked light, draws it through its camera, and sends the picture's floats to the test.

import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { useBakedLight } from '/photon_bake.js';

const asked = new URLSearchParams( location.search );
const width = Number( asked.get( 'width' ) ), height = Number( asked.get( 'height' ) );

async function draw() {

	const gltf = await new GLTFLoader().loadAsync( '/scene/scene.glb' );
	if ( asked.has( 'baked' ) ) await useBakedLight( gltf.scene, '/scene/', { prefer: asked.get( 'baked' ) } );
	const renderer = new THREE.WebGLRenderer();
	renderer.shadowMap.enabled = true;
	renderer.shadowMap.type = THREE.BasicShadowMap;
	gltf.scene.traverse( ( object ) => {

		if ( object.isLight ) prepare( object );
		if ( object.isMesh ) object.castShadow = object.receiveShadow = true;

	} );
	const camera = gltf.cameras[ 0 ];
	camera.aspect = width / height;
	camera.updateProjectionMatrix();
	const target = new THREE.WebGLRenderTarget( width, height, { type: THREE.FloatType } );
	const scene = new THREE.Scene();
	scene.add( gltf.scene );
	renderer.setRenderTarget( target ); // linear, and without tone mapping
	renderer.render( scene, camera );
	const pixels = new Float32Array( width * height * 4 );
	renderer.readRenderTargetPixels( target, 0, 0, width, height, pixels );
	return pixels;

}

function prepare( light ) {

	light.visible = asked.has( 'lights' );
	light.castShadow = true;
	light.shadow.mapSize.set( 2048, 2048 );
	light.shadow.bias = - 1e-4;
	light.shadow.normalBias = 0.01;
	if ( light.isDirectionalLight )
		Object.assign( light.shadow.camera, { left: - 6, right: 6, bottom: - 6, top: 6, near: - 20, far: 40 } );

}

draw().then(
	( pixels ) => fetch( '/done', { method: 'POST', body: pixels.buffer } ),
	( error ) => fetch( '/failed', { method: 'POST', body: `${ error.stack ?? error }` } )
);
